#include "processing/normals/predicted_sigma.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_reduce.h>

#include <Eigen/Dense>
#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <functional>
#include <numbers>
#include <numeric>
#include <vector>

#include "processing/normals/pixel_sample.h"

namespace darkbox {
namespace {

constexpr float degrees_per_radian = static_cast<float>(180.0 / std::numbers::pi);
constexpr float pooled_freedom = 6.0F;  ///< degrees of freedom that the picture's variance counts for in each pixel

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

/// What a residual shows beyond the variance that was expected. By chance alone it varies by a factor of
/// 1 + sqrt(2 / freedom) or so: up to twice that nothing is shown.
float excess(float variance, float expected, float freedom) {
    const float by_chance = 1.0F + 2.0F * std::sqrt(2.0F / std::max(freedom, 1.0F));
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

LeastSquaresSigma::LeastSquaresSigma(const LightField& field, const NoiseModel& noise)
    : lights_(static_cast<float>(field.size())) {
    Eigen::Matrix3d moments = Eigen::Matrix3d::Zero();
    const auto count = static_cast<double>(field.size());
    for (std::size_t k = 0; k < field.size(); ++k) {
        const SolverLight& light = field.set().lights[k];
        const Eigen::Vector3d l = light.direction.cast<double>();
        moments += l * l.transpose();
        const Eigen::Vector3d column = light.pseudo_column.cast<double>();
        const Symmetric outer = packed(column * column.transpose());
        const auto per_intensity = 1.0 / static_cast<double>(mean_intensity(light));
        const double dark = noise.variance(0) * per_intensity * per_intensity;
        const Eigen::Vector3f shot = (l * noise.shot_gain * per_intensity).cast<float>();
        Symmetric lamp = packed(field.light(k).covariance);
        for (const int off_diagonal : {1, 2, 4}) lamp[off_diagonal] *= 2;
        dark_ += outer * static_cast<float>(dark);
        shot_ += outer * shot.transpose();
        lamps_ += outer * lamp.transpose();
        mean_dark_ += static_cast<float>(dark / count);
        mean_shot_ += shot / static_cast<float>(count);
        mean_lamps_ += lamp / static_cast<float>(count);
    }
    inverse_moments_ = packed(moments.inverse());
    lamps_known_ = !lamps_.isZero(0);
}

float LeastSquaresSigma::at(const Eigen::Vector3f& normal, float albedo, float variance, float used) const {
    const Eigen::Vector3f g = normal * albedo;
    Symmetric pairs = Symmetric::Zero();
    if (lamps_known_) pairs << g.x() * g.x(), g.x() * g.y(), g.x() * g.z(), g.y() * g.y(), g.y() * g.z(), g.z() * g.z();
    const float expected = std::max(mean_dark_ + mean_shot_.dot(g) + mean_lamps_.dot(pairs), 0.0F);
    const float beyond = excess(variance, expected, used - 3 + pooled_freedom);
    Symmetric covariance = dark_ + shot_ * g + beyond * inverse_moments_;
    if (lamps_known_) covariance += lamps_ * pairs;
    return sigma_deg(covariance * (lights_ / used), normal, albedo);
}

void LeastSquaresSigma::write_row(float picture_variance, int row, SolvedMaps& maps) const {
    for (int x = 0; x < maps.valid.cols; ++x) {
        maps.sigma_deg(row, x) = 0;
        if (!maps.valid(row, x)) continue;
        const cv::Vec3f &n = maps.normal(row, x), &rgb = maps.albedo(row, x);
        const auto used = static_cast<float>(maps.lights_used(row, x));
        const float squares = maps.residual(row, x) * maps.residual(row, x) * used;
        const float variance = (squares + pooled_freedom * picture_variance) / (used - 3 + pooled_freedom);
        maps.sigma_deg(row, x) = at({n[0], n[1], n[2]}, (rgb[0] + rgb[1] + rgb[2]) / 3.0F, variance, used);
    }
}

namespace {

/// Numbers that are not negative sort as their bits do: buckets of neighbouring ones by the upper half of those.
using Counts = std::vector<std::size_t>;
constexpr std::size_t buckets = 1 << 16;
std::size_t bucket_of(float value) { return std::bit_cast<std::uint32_t>(value) >> 16; }

/// Calls `take` with each variance of the row that tells something.
template <class Take>
void visit_variances(const SolvedMaps& maps, int row, Take take) {
    for (int x = 0; x < maps.valid.cols; ++x)
        if (const int used = maps.lights_used(row, x); maps.valid(row, x) && used > 3)
            take(maps.residual(row, x) * maps.residual(row, x) * static_cast<float>(used) /
                 static_cast<float>(used - 3));
}

Counts counts_by_bucket(const SolvedMaps& maps) {
    return tbb::parallel_reduce(
        tbb::blocked_range<int>(0, maps.valid.rows, 256), Counts(buckets, 0),
        [&](const tbb::blocked_range<int>& rows, Counts counts) {
            for (int row = rows.begin(); row < rows.end(); ++row)
                visit_variances(maps, row, [&](float variance) { ++counts[bucket_of(variance)]; });
            return counts;
        },
        [](Counts a, const Counts& b) {
            std::transform(a.begin(), a.end(), b.begin(), a.begin(), std::plus<>());
            return a;
        });
}

}  // namespace

float median_variance(const SolvedMaps& maps) {
    const Counts counts = counts_by_bucket(maps);
    std::size_t rank = std::accumulate(counts.begin(), counts.end(), std::size_t{0}) / 2, bucket = 0;
    for (; bucket < buckets && rank >= counts[bucket]; ++bucket) rank -= counts[bucket];
    if (bucket == buckets) return 0;
    std::vector<float> near_median;
    near_median.reserve(counts[bucket]);
    for (int row = 0; row < maps.valid.rows; ++row)
        visit_variances(maps, row, [&](float variance) {
            if (bucket_of(variance) == bucket) near_median.push_back(variance);
        });
    const auto middle = near_median.begin() + static_cast<std::ptrdiff_t>(rank);
    std::nth_element(near_median.begin(), middle, near_median.end());
    return *middle;
}

}  // namespace darkbox
