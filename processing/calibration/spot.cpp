#include "processing/calibration/spot.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

namespace darkbox {
namespace {

constexpr double floor_share = 0.1;        ///< of a spot's height: radiance that counts
constexpr double upper_share = 0.45;       ///< its upper part, for comparison
constexpr double steady_sigma_px = 0.007;  ///< what pixels and the threshold leave without noise: simulated
constexpr double blind_px = 0.29;          ///< standard deviation of a place known to one pixel
constexpr double blur_px2 = 0.4;           ///< second moment that pixels and optics add to a spot
constexpr double bloom_px = 0.7;           ///< by which a saturated spot outgrows the lamp's image
constexpr double border_sigma = 0.15;      ///< px; of a saturated spot of radius 1, less for larger ones: simulated
constexpr double part_sigma = 0.1;         ///< of the upper and lower parts' disagreement: simulated
constexpr double round_residual = 0.12;   ///< squares per pixel of border, below which a saturated spot is a round lamp
constexpr double odd_shape_sigma = 0.02;  ///< of the radius: a saturated spot of another shape hides its lamp's middle

struct Centroid {
    cv::Point2d at;
    double sum = 0;
    double spread = 0;  ///< second moment per axis, px^2
};

Centroid centroid_above(const SpotPatch& patch, double share) {
    const double floor = patch.background + share * (patch.top - patch.background);
    Centroid c;
    for (std::size_t i = 0; i < patch.at.size(); ++i) {
        const double weight = std::max(0.0, patch.value[i] - floor);
        c.sum += weight;
        c.at += weight * patch.at[i];
    }
    c.at /= c.sum;
    for (std::size_t i = 0; i < patch.at.size(); ++i) {
        const cv::Point2d d = patch.at[i] - c.at;
        c.spread += std::max(0.0, patch.value[i] - floor) * d.dot(d) / (2 * c.sum);
    }
    return c;
}

/// What noise of one unit does to the centroid in every pixel that counts, or that noise can make count.
double noise_gain(const SpotPatch& patch, const Centroid& c) {
    const double floor = patch.background + floor_share * (patch.top - patch.background);
    double squares = 0;
    for (std::size_t i = 0; i < patch.at.size(); ++i)
        if (patch.value[i] > floor - 2 * patch.noise) squares += (patch.at[i] - c.at).dot(patch.at[i] - c.at) / 2;
    return std::sqrt(squares) / c.sum;
}

SpotMeasure by_centroid(const SpotPatch& patch) {
    const Centroid whole = centroid_above(patch, floor_share), upper = centroid_above(patch, upper_share);
    SpotMeasure measure;
    measure.at = whole.at;
    measure.radius_px = 2 * std::sqrt(std::max(0.0, whole.spread - blur_px2));  // of a uniform disc
    const double pixel = blind_px * std::exp(-whole.spread / 0.06);
    const double disagreement = part_sigma * std::hypot(whole.at.x - upper.at.x, whole.at.y - upper.at.y);
    measure.sigma_px =
        std::hypot(patch.noise * noise_gain(patch, whole), std::hypot(pixel, steady_sigma_px, disagreement));
    return measure;
}

/// Border fit: value = 1 / (1 + exp(-steepness (radius - distance))), distance in the spot's elliptic measure.
struct BorderFit {
    Eigen::Vector3d p{0, 0, 1};  ///< x, y, radius
    double residual = 0;         ///< sum of squares
    Eigen::Vector3d gradient = Eigen::Vector3d::Zero();
    Eigen::Matrix3d information = Eigen::Matrix3d::Zero();
};

/// The fit's residual and derivatives at p.
BorderFit border_at(const SpotPatch& patch, const Eigen::Vector3d& p, double steepness) {
    const cv::Point2d along(-patch.narrow.y, patch.narrow.x);
    const double a = 1 / std::sqrt(patch.roundness), b = 1 / a;
    BorderFit fit;
    fit.p = p;
    for (std::size_t i = 0; i < patch.at.size(); ++i) {
        const cv::Point2d d = patch.at[i] - cv::Point2d(p[0], p[1]);
        const double across = a * d.dot(patch.narrow), length = b * d.dot(along);
        const double distance = std::max(1e-6, std::hypot(across, length));
        const double model = 1 / (1 + std::exp(-steepness * (p[2] - distance)));
        const double seen = (patch.value[i] - patch.background) / (patch.top - patch.background);
        const double slope = steepness * model * (1 - model);
        const cv::Point2d outwards = (a * across * patch.narrow + b * length * along) / distance;
        const Eigen::Vector3d row = slope * Eigen::Vector3d(outwards.x, outwards.y, 1);
        fit.residual += (model - seen) * (model - seen);
        fit.gradient += (model - seen) * row;
        fit.information += row * row.transpose();
    }
    return fit;
}

/// Gauss-Newton steps with Levenberg's damping.
BorderFit fit_border(const SpotPatch& patch, const Eigen::Vector3d& start, double steepness) {
    BorderFit fit = border_at(patch, start, steepness);
    double damping = 1e-3;
    for (int step = 0; step < 60 && damping < 1e6; ++step) {
        const Eigen::Matrix3d damped = fit.information + damping * Eigen::Matrix3d::Identity();
        const Eigen::Vector3d move = damped.ldlt().solve(fit.gradient);
        const BorderFit next = border_at(patch, fit.p - move, steepness);
        if (!(next.p[2] > 0 && next.residual < fit.residual)) {
            damping *= 8;
            continue;
        }
        fit = next;
        damping /= 4;
        if (move.norm() < 1e-6) break;
    }
    return fit;
}

SpotMeasure by_border(const SpotPatch& patch) {
    const Centroid start = centroid_above(patch, floor_share);
    Eigen::Vector3d at(start.at.x, start.at.y, 2 * std::sqrt(start.spread));
    std::optional<BorderFit> best;
    for (const double steepness : {2.0, 4.0, 8.0, 16.0}) {
        const BorderFit fit = fit_border(patch, at, steepness);
        at = fit.p;
        if (!best || fit.residual < best->residual) best = fit;
    }
    const double radius = best->p[2];
    const cv::Point2d middle(best->p[0], best->p[1]);
    SpotMeasure measure{middle, border_sigma / radius, std::max(0.0, radius - bloom_px)};
    if (best->residual > round_residual * 2 * std::numbers::pi * radius) {
        measure.at = start.at;
        measure.sigma_px = std::hypot(measure.sigma_px, cv::norm(middle - start.at) / 2, odd_shape_sigma * radius);
    }
    return measure;
}

}  // namespace

SpotMeasure measure_spot(const SpotPatch& patch) { return patch.clipped ? by_border(patch) : by_centroid(patch); }

}  // namespace darkbox
