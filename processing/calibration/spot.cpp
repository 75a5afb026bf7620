#include "processing/calibration/spot.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

namespace darkbox {
namespace {

constexpr double floor_share = 0.1;        ///< of a spot's height: radiance that counts
constexpr double steady_sigma_px = 0.002;  ///< what is left without noise: simulated
constexpr double blind_px = 0.29;          ///< standard deviation of a place known to one pixel
constexpr double blind_spread_px2 = 0.1;   ///< second moment by which a spot tells more of its place: simulated
constexpr int most_fit_rounds = 20;
constexpr double blur_px2 = 0.4;          ///< second moment that pixels and optics add to a spot
constexpr double bloom_px = 0.7;          ///< by which a saturated spot outgrows the lamp's image
constexpr double border_sigma = 0.15;     ///< px; of a saturated spot of radius 1, less for larger ones: simulated
constexpr double core_sigma = 0.3;        ///< of the whole spot's and its core's disagreement
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

/// A centroid weighted by radiance and by a Gaussian window that moves with it, wider than the spot: no pixel enters or
/// leaves at a threshold, so that the place does not hang on where the spot lies between pixels (as SExtractor's
/// windowed positions, Bertin 2010).
struct Windowed {
    cv::Point2d at;
    double sigma_px = 0;  ///< standard deviation per axis that noise gives
    double spread = 0;    ///< second moment per axis of the whole spot, px^2, were it Gaussian
};

Windowed windowed_centroid(const SpotPatch& patch, const Centroid& start, double window2) {
    const double overshoot = 1 + start.spread / window2;  // by which the window holds the place back, Gaussian spots
    Windowed w{start.at, 0, start.spread};
    for (int round = 0; round < most_fit_rounds; ++round) {
        double sum = 0, moment = 0, even = 0, grainy = 0;
        cv::Point2d pull(0, 0);
        for (std::size_t i = 0; i < patch.at.size(); ++i) {
            const cv::Point2d d = patch.at[i] - w.at;
            const double window = std::exp(-d.dot(d) / (2 * window2));
            const double weight = window * (patch.value[i] - patch.background);
            sum += weight;
            pull += weight * d;
            moment += weight * d.dot(d) / 2;
            const double gain = window * window * d.dot(d) / 2;
            even += gain * patch.noise * patch.noise;
            grainy += gain * patch.grain[i] * patch.grain[i];
        }
        if (!(sum > 0)) return {start.at, blind_px, start.spread};
        const cv::Point2d move = overshoot / sum * pull;
        w.at += move;
        if (moment > 0) w.spread = 1 / std::max(1 / (4 * window2), sum / moment - 1 / window2);
        w.sigma_px = overshoot * std::sqrt(std::max(even, grainy)) / sum;
        if (cv::norm(move) < 1e-5) break;
    }
    return w;
}

SpotMeasure by_centroid(const SpotPatch& patch) {
    const Centroid start = centroid_above(patch, floor_share);
    const Windowed windowed = windowed_centroid(patch, start, 2 * start.spread + 1);
    const Windowed core = windowed_centroid(patch, start, start.spread + 0.5);
    SpotMeasure measure;
    measure.at = windowed.at;
    measure.windowed = true;
    measure.radius_px = 2 * std::sqrt(std::max(0.0, windowed.spread - blur_px2));  // of a uniform disc
    const double pixel = blind_px * std::exp(-windowed.spread / blind_spread_px2);
    const double disagreement = core_sigma * cv::norm(windowed.at - core.at);
    measure.sigma_px = std::hypot(windowed.sigma_px, std::hypot(pixel, steady_sigma_px, disagreement));
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
    SpotMeasure measure{middle, border_sigma / radius, std::max(0.0, radius - bloom_px), false};
    if (best->residual > round_residual * 2 * std::numbers::pi * radius) {
        measure.at = start.at;
        measure.sigma_px = std::hypot(measure.sigma_px, cv::norm(middle - start.at) / 2, odd_shape_sigma * radius);
    }
    return measure;
}

}  // namespace

SpotMeasure measure_spot(const SpotPatch& patch) { return patch.clipped ? by_border(patch) : by_centroid(patch); }

}  // namespace darkbox
