#include "processing/formats/report/ellipse.h"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

namespace darkbox {
namespace {

constexpr double small_step = 1e-4;  // radians, to differentiate a mapping

}  // namespace

std::optional<Ellipse> uncertainty(const Light& light, const Mapping& mapping) {
    if (!(light.covariance.trace() > 0)) return std::nullopt;
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> axes(light.covariance);
    Eigen::Matrix2d shown = Eigen::Matrix2d::Zero();
    for (int i = 0; i < 3; ++i) {
        const Eigen::Vector3d step = axes.eigenvectors().col(i) * small_step;
        const Eigen::Vector2d slope =
            (mapping((light.direction + step).normalized()) - mapping((light.direction - step).normalized())) /
            (2 * small_step);
        shown += std::max(axes.eigenvalues()[i], 0.0) * slope * slope.transpose();
    }
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> plane(shown);
    const Eigen::Vector2d major = plane.eigenvectors().col(1);
    return Ellipse{std::sqrt(std::max(plane.eigenvalues()[1], 0.0)), std::sqrt(std::max(plane.eigenvalues()[0], 0.0)),
                   std::atan2(major.y(), major.x()) * 180 / std::numbers::pi};
}

double magnification_for(const Lights& lights, const Mapping& mapping, double wanted_size) {
    std::vector<double> sizes;
    for (const Light& light : lights)
        if (const auto ellipse = uncertainty(light, mapping)) sizes.push_back(ellipse->major);
    if (sizes.empty()) return 1;
    const auto middle = sizes.begin() + static_cast<std::ptrdiff_t>(sizes.size() / 2);
    std::nth_element(sizes.begin(), middle, sizes.end());
    if (!(*middle > 0 && std::isfinite(*middle))) return 1;
    double factor = 1;
    for (int i = 0; *middle * factor < wanted_size && factor < 1e6; ++i) factor *= i % 3 == 1 ? 2.5 : 2.0;
    return factor;
}

std::string ellipse_svg(const std::optional<Ellipse>& ellipse, const Eigen::Vector2d& at, double magnification) {
    if (!ellipse) return {};
    return fmt::format(
        "<ellipse class='sigma' cx='{0:.2f}' cy='{1:.2f}' rx='{2:.2f}' ry='{3:.2f}' transform='rotate({4:.1f} {0:.2f} "
        "{1:.2f})'/>",
        at.x(), at.y(), ellipse->major * magnification, ellipse->minor * magnification, ellipse->angle_deg);
}

}  // namespace darkbox
