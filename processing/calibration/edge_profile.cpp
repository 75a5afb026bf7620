#include "processing/calibration/edge_profile.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <numbers>

namespace darkbox {
namespace {

constexpr double offset_step_px = 0.125;
constexpr double root_ridge = 1e-4;  ///< keeps the fit solvable where no sample lies inside

double step_within(double depth_px, double blur_px) {
    return 0.5 * std::erfc(-depth_px / (blur_px * std::numbers::sqrt2));
}

/// sqrt(depth) for depth > 0, blurred: a sum over the blur's Gaussian.
double root_within(double depth_px, double blur_px) {
    constexpr int points = 48;
    constexpr double reach = 4;
    double sum = 0, weights = 0;
    for (int i = 0; i < points; ++i) {
        const double x = reach * (2 * (i + 0.5) / points - 1), weight = std::exp(-x * x / 2);
        weights += weight;
        sum += weight * std::sqrt(std::max(0.0, depth_px + blur_px * x));
    }
    return sum / weights;
}

}  // namespace

ProfileModel::ProfileModel(int half, double step_px, double blur_px, double reach_px) {
    const int n = 2 * half + 1, steps = static_cast<int>(reach_px / offset_step_px);
    for (int i = -steps; i <= steps; ++i) {
        const double offset = i * offset_step_px;
        Eigen::MatrixXd basis(n, 3);
        for (int k = 0; k < n; ++k) {
            const double depth = offset - (k - half) * step_px;
            basis.row(k) << 1, step_within(depth, blur_px), root_within(depth, blur_px);
        }
        Eigen::Matrix3d normal = basis.transpose() * basis;
        normal(2, 2) *= 1 + root_ridge;
        const Eigen::LLT<Eigen::Matrix3d> factor(normal);
        offsets_.push_back(offset);
        explained_.emplace_back(factor.matrixL().solve(basis.transpose()));
    }
}

std::optional<ProfileEdge> ProfileModel::fit(const std::vector<double>& profile) const {
    Eigen::VectorXd p = Eigen::Map<const Eigen::VectorXd>(profile.data(), static_cast<Eigen::Index>(profile.size()));
    p.array() -= p.mean();
    const double all = p.squaredNorm();
    std::vector<double> left;
    for (const Eigen::MatrixXd& rows : explained_) left.push_back(all - (rows * p).squaredNorm());
    const auto least = std::min_element(left.begin(), left.end());
    if (least == left.begin() || least == left.end() - 1) return std::nullopt;
    const auto i = static_cast<std::size_t>(least - left.begin());
    const double before = left[i - 1], at = left[i], after = left[i + 1], bend = before - 2 * at + after;
    const double shift = bend > 0 ? 0.5 * (before - after) / bend : 0;
    return ProfileEdge{offsets_[i] + shift * offset_step_px,
                       std::sqrt(std::max(0.0, all - at) / static_cast<double>(profile.size())), at};
}

}  // namespace darkbox
