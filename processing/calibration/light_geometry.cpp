#include "processing/calibration/light_geometry.h"

#include <fmt/format.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "processing/calibration/normal_error.h"

namespace darkbox {
namespace {

constexpr int normals_sampled = 2000;

bool lights_up(const Light& light, const Eigen::Vector3d& normal) {
    return light.used && normal.dot(light.direction) > 0;
}

Eigen::Matrix3d information_at(const Lights& lights, const Eigen::Vector3d& normal) {
    Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
    for (const Light& light : lights)
        if (lights_up(light, normal)) sum += light.direction * light.direction.transpose();
    return sum;
}

/// A light that is off by d changes g by -M^-1 L (d.g): first order, residuals zero.
double direction_error_at(const Lights& lights, const Eigen::Matrix3d& information, const Eigen::Vector3d& normal) {
    Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
    for (const Light& light : lights)
        if (lights_up(light, normal))
            spread += normal.dot(light.covariance * normal) * light.direction * light.direction.transpose();
    const Eigen::Matrix3d inverse = information.inverse();
    const Eigen::Matrix3d covariance = inverse * spread * inverse;
    return std::sqrt(std::max(0.0, covariance.trace() - normal.dot(covariance * normal))) * 180 / std::numbers::pi;
}

bool covariances_known(const Lights& lights) {
    return std::all_of(lights.begin(), lights.end(), [](const Light& l) { return !l.used || l.sigma_deg() > 0; });
}

}  // namespace

LightGeometry light_geometry(const Lights& lights) {
    LightGeometry geometry;
    geometry.condition_number = condition_number(lights);
    double noise_sum = 0, direction_sum = 0;
    int determined = 0;
    for (const Eigen::Vector3d& normal : visible_normals(normals_sampled)) {
        const Eigen::Matrix3d information = information_at(lights, normal);
        if (!determines_normals(information)) continue;
        ++determined;
        noise_sum += normal_error_deg(information, normal, reference_noise);
        direction_sum += direction_error_at(lights, information, normal);
    }
    geometry.undetermined_share = 1.0 - static_cast<double>(determined) / normals_sampled;
    if (determined == 0) return geometry;
    geometry.noise_error_deg = noise_sum / determined;
    if (covariances_known(lights)) geometry.direction_error_deg = direction_sum / determined;
    return geometry;
}

std::string in_words(const LightGeometry& geometry) {
    if (!geometry.noise_error_deg) return "these lights determine no normal";
    std::string words =
        fmt::format("1 % of noise turns normals by {:.2f} degrees on average", *geometry.noise_error_deg);
    if (geometry.direction_error_deg)
        words += fmt::format(", the light directions' own uncertainty by {:.2f}", *geometry.direction_error_deg);
    if (geometry.undetermined_share >= 0.005)
        words += fmt::format("; {:.0f} % of the visible normals are lit by too few lights",
                             100 * geometry.undetermined_share);
    return words;
}

}  // namespace darkbox
