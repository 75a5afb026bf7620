#include "processing/normals/predicted_sigma.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "processing/normals/pixel_sample.h"

namespace darkbox {
namespace {

constexpr float degrees_per_radian = static_cast<float>(180.0 / std::numbers::pi);

using Symmetric = Eigen::Matrix<float, 6, 1>;

Symmetric packed(const Eigen::Matrix3d& m) {
    Symmetric s;
    s << static_cast<float>(m(0, 0)), static_cast<float>(m(0, 1)), static_cast<float>(m(0, 2)),
        static_cast<float>(m(1, 1)), static_cast<float>(m(1, 2)), static_cast<float>(m(2, 2));
    return s;
}

/// v' M v as a product with packed(M).
Symmetric products(const Eigen::Vector3f& v) {
    Symmetric s;
    s << v.x() * v.x(), 2 * v.x() * v.y(), 2 * v.x() * v.z(), v.y() * v.y(), 2 * v.y() * v.z(), v.z() * v.z();
    return s;
}

float sigma_deg(const Symmetric& covariance, const Eigen::Vector3f& normal, float length) {
    const float trace = covariance[0] + covariance[3] + covariance[5];
    const float tangential = std::max(trace - covariance.dot(products(normal)), 0.0F);
    return std::sqrt(tangential / 2) / length * degrees_per_radian;
}

float excess(float variance, float expected, float freedom) {
    const float by_chance = 1.0F + chance_factor * std::sqrt(2.0F / std::max(freedom, 1.0F));
    return variance > by_chance * expected ? variance - expected : 0.0F;
}

}  // namespace

float predicted_sigma_deg(const PixelFit& fit, const PixelSolver& solver, const LightField& field) {
    const PixelSamples& samples = solver.samples;
    const auto lamp_variance = [&](std::size_t k) {
        const Eigen::Vector3d g = fit.g.cast<double>();
        return static_cast<float>(g.dot(field.light(k).covariance * g));
    };
    float expected = 0, total = 0;
    for (std::size_t k = 0; k < samples.size(); ++k) {
        expected += solver.weights()[k] * (samples.noise_variance[k] + lamp_variance(k));
        total += solver.weights()[k];
    }
    if (!(total > 0)) return 0;
    const float beyond = excess(fit.variance, expected / total, static_cast<float>(fit.used - 3));
    Eigen::Matrix3d moments = Eigen::Matrix3d::Zero(), spread = Eigen::Matrix3d::Zero();
    for (std::size_t k = 0; k < samples.size(); ++k) {
        const auto weight = static_cast<double>(solver.weights()[k]);
        const auto variance = static_cast<double>(samples.noise_variance[k] + lamp_variance(k) + beyond);
        const Eigen::Vector3d along = solver.derivative(k).cast<double>();
        moments += weight * along * along.transpose();
        spread += weight * weight * variance * along * along.transpose();
    }
    const Eigen::Matrix3d inverse = moments.inverse();
    return sigma_deg(packed(inverse * spread * inverse), fit.g.normalized(), fit.g.norm());
}

}  // namespace darkbox
