#include "processing/calibration/lambert_cost.h"

#include <Eigen/Dense>
#include <cmath>
#include <utility>
#include <vector>

namespace darkbox {

LambertCost::LambertCost(Eigen::VectorXd samples, double sigma, const Geometry& geometry)
    : samples_(std::move(samples)), sigma_(sigma), geometry_(geometry) {
    const auto count = static_cast<int>(samples_.size());
    set_num_residuals(count);
    for (int k = 0; k < count; ++k) mutable_parameter_block_sizes()->push_back(3);
    for (int k = 0; k < count; ++k) mutable_parameter_block_sizes()->push_back(1);
}

bool LambertCost::Evaluate(double const* const* parameters, double* residuals, double** jacobians) const {
    const Eigen::Index n = samples_.size();
    Eigen::MatrixX3d irradiance(n, 3);  // intensity times direction times fall-off
    std::vector<Eigen::Matrix3d> by_lamp(static_cast<std::size_t>(n));
    for (Eigen::Index k = 0; k < n; ++k) {
        const Eigen::Map<const Eigen::Vector3d> lamp(parameters[k]);
        const double intensity = std::exp(parameters[n + k][0]);
        Eigen::Vector3d incoming = lamp;
        by_lamp[static_cast<std::size_t>(k)].setIdentity();
        if (geometry_.near) {
            const Eigen::Vector3d away = lamp - geometry_.point_mm;
            const double squared = away.squaredNorm();
            const double scale = geometry_.unit_mm * geometry_.unit_mm / (squared * std::sqrt(squared));
            incoming = scale * away;
            by_lamp[static_cast<std::size_t>(k)] =
                scale * (Eigen::Matrix3d::Identity() - 3 / squared * away * away.transpose());
        }
        irradiance.row(k) = intensity * incoming.transpose();
        by_lamp[static_cast<std::size_t>(k)] *= intensity;
    }
    const Eigen::Matrix3d normal = irradiance.transpose() * irradiance;
    const Eigen::LDLT<Eigen::Matrix3d> factor(normal);
    if (factor.info() != Eigen::Success || !factor.isPositive()) return false;
    const Eigen::Vector3d surface = factor.solve(irradiance.transpose() * samples_);
    const Eigen::VectorXd left = samples_ - irradiance * surface;
    Eigen::Map<Eigen::VectorXd>(residuals, n) = left / sigma_;
    if (!jacobians) return true;
    const Eigen::MatrixXd pulled = irradiance * factor.solve(Eigen::Matrix3d::Identity());  // n x 3
    for (Eigen::Index k = 0; k < n; ++k) {
        Eigen::VectorXd projected = -pulled * irradiance.row(k).transpose();
        projected[k] += 1;
        // By a change d of the k-th row of `irradiance`: -projected (d . surface) - pulled d left[k].
        const Eigen::MatrixXd by_row = -(projected * surface.transpose() + left[k] * pulled) / sigma_;  // n x 3
        if (jacobians[k])
            Eigen::Map<Eigen::Matrix<double, Eigen::Dynamic, 3, Eigen::RowMajor>>(jacobians[k], n, 3) =
                by_row * by_lamp[static_cast<std::size_t>(k)];
        if (jacobians[n + k]) Eigen::Map<Eigen::VectorXd>(jacobians[n + k], n) = by_row * irradiance.row(k).transpose();
    }
    return true;
}

}  // namespace darkbox
