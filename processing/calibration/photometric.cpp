#include "processing/calibration/photometric.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <map>

#include "processing/calibration/contour_noise.h"

namespace darkbox {
namespace {

constexpr double samples_wanted = 6000;
constexpr double fewest_pixels = 150;
constexpr double least_of_brightest = 0.1;  ///< darker samples may be in shadow
constexpr double rejected_sample_sigmas = 3;
constexpr double least_sigma = 1e-4;  ///< of a pixel's brightest sample
constexpr int rounds = 30;
constexpr int trim_every = 5;
constexpr Eigen::Index fewest_kept = 5;  ///< of a pixel's samples: three are used up by its normal
constexpr double fewest_per_frame = 30;
constexpr double patch_px = 24;  ///< within which errors of the law may be alike

/// The rank-three fit at work: radiance is about surface * lamps.transpose() where kept.
struct Factors {
    Eigen::MatrixX3d surface;  ///< albedo times normal, a row per pixel
    Eigen::MatrixX3d lamps;    ///< intensity times direction, a row per frame
};

/// Least squares for each row of `unknown`: values.row(i) = known * unknown.row(i), over the samples that are kept.
Eigen::MatrixX3d solved(const Eigen::MatrixXd& values, const Eigen::MatrixXd& kept, const Eigen::MatrixX3d& known) {
    Eigen::MatrixX3d unknown = Eigen::MatrixX3d::Zero(values.rows(), 3);
    for (Eigen::Index i = 0; i < values.rows(); ++i) {
        const Eigen::MatrixX3d weighted = kept.row(i).transpose().asDiagonal() * known;
        const Eigen::Matrix3d normal = weighted.transpose() * known;
        unknown.row(i) =
            normal.completeOrthogonalDecomposition().solve(weighted.transpose() * values.row(i).transpose());
    }
    return unknown;
}

Eigen::MatrixXd residuals_of(const LambertSamples& samples, const Factors& factors) {
    return (samples.radiance - factors.surface * factors.lamps.transpose()).cwiseProduct(samples.kept);
}

/// Each kept sample's residual, as a list.
std::vector<double> listed(const Eigen::MatrixXd& residuals, const Eigen::MatrixXd& kept) {
    std::vector<double> list;
    for (Eigen::Index f = 0; f < kept.cols(); ++f)
        for (Eigen::Index p = 0; p < kept.rows(); ++p)
            if (kept(p, f) > 0) list.push_back(residuals(p, f));
    return list;
}

void leave_out_strays(LambertSamples& samples, const Eigen::MatrixXd& usable, const Factors& factors) {
    const double sigma = std::max(least_sigma, robust_sigma(listed(residuals_of(samples, factors), samples.kept)));
    const Eigen::MatrixXd expected = factors.surface * factors.lamps.transpose();
    for (Eigen::Index p = 0; p < usable.rows(); ++p) {
        for (Eigen::Index f = 0; f < usable.cols(); ++f)
            samples.kept(p, f) =
                usable(p, f) > 0 && expected(p, f) > 0 &&
                        std::abs(samples.radiance(p, f) - expected(p, f)) < rejected_sample_sigmas * sigma
                    ? 1
                    : 0;
        if (samples.kept.row(p).sum() < fewest_kept) samples.kept.row(p).setZero();
    }
}

/// By how much patches of neighbours pull a light more than independent samples would: the squares of the patches'
/// pulls over the sum of the samples' own.
double likeness(const LambertSamples& samples, const Factors& factors) {
    const Eigen::MatrixXd residuals = residuals_of(samples, factors);
    double together = 0, alone = 0;
    for (Eigen::Index f = 0; f < residuals.cols(); ++f) {
        std::map<std::pair<int, int>, Eigen::Vector3d> patches;
        for (Eigen::Index p = 0; p < residuals.rows(); ++p) {
            if (samples.kept(p, f) == 0) continue;
            const cv::Point2d& at = samples.at[static_cast<std::size_t>(p)];
            const std::pair patch(static_cast<int>(at.x / patch_px), static_cast<int>(at.y / patch_px));
            const Eigen::Vector3d pull = residuals(p, f) * factors.surface.row(p).transpose();
            patches.try_emplace(patch, Eigen::Vector3d::Zero()).first->second += pull;
            alone += pull.squaredNorm();
        }
        for (const auto& [place, pull] : patches) together += pull.squaredNorm();
    }
    return alone > 0 ? std::max(1.0, together / alone) : 1;
}

/// Pixels without a kept sample go.
LambertSamples without_empty(LambertSamples samples) {
    LambertSamples left = samples;
    left.at.clear();
    for (Eigen::Index p = 0; p < samples.kept.rows(); ++p) {
        if (samples.kept.row(p).sum() == 0) continue;
        const auto to = static_cast<Eigen::Index>(left.at.size());
        left.radiance.row(to) = samples.radiance.row(p);
        left.kept.row(to) = samples.kept.row(p);
        left.at.push_back(samples.at[static_cast<std::size_t>(p)]);
    }
    const auto pixels = static_cast<Eigen::Index>(left.at.size());
    left.radiance.conservativeResize(pixels, Eigen::NoChange);
    left.kept.conservativeResize(pixels, Eigen::NoChange);
    return left;
}

}  // namespace

double LambertSamples::effective_sigma() const { return sigma * std::sqrt(samples_per_independent); }

bool LambertSamples::tells(std::size_t frame) const {
    return !empty() && kept.col(static_cast<Eigen::Index>(frame)).sum() >= fewest_per_frame;
}

ObjectPixels object_pixels(const PhotoStack& stack) {
    require_consistent(stack);
    const auto frames = static_cast<Eigen::Index>(stack.images.size());
    const double wanted = std::max(fewest_pixels, samples_wanted / static_cast<double>(frames));
    const int step = std::max(1, static_cast<int>(std::sqrt(cv::countNonZero(stack.mask) / wanted)));
    ObjectPixels pixels;
    for (int y = step / 2; y < stack.mask.rows; y += step)
        for (int x = step / 2; x < stack.mask.cols; x += step)
            if (stack.mask(y, x)) pixels.at.emplace_back(x, y);
    pixels.radiance.resize(static_cast<Eigen::Index>(pixels.at.size()), frames);
    for (Eigen::Index f = 0; f < frames; ++f)
        for (Eigen::Index p = 0; p < pixels.radiance.rows(); ++p) {
            const cv::Point at(pixels.at[static_cast<std::size_t>(p)]);
            const cv::Vec3f& colour = stack.images[static_cast<std::size_t>(f)](at);
            const double mean = (static_cast<double>(colour[0]) + colour[1] + colour[2]) / 3;
            const bool usable = std::isfinite(mean) && !stack.clipped[static_cast<std::size_t>(f)](at);
            pixels.radiance(p, f) = usable ? std::max(0.0, mean) : -1;
        }
    return pixels;
}

LambertSamples lambert_samples(const ObjectPixels& pixels, const std::vector<Eigen::Vector3d>& directions) {
    LambertSamples samples;
    if (pixels.empty()) return samples;
    samples.at = pixels.at;
    samples.radiance = pixels.radiance;
    Factors factors;
    factors.lamps.resize(pixels.radiance.cols(), 3);
    for (Eigen::Index f = 0; f < factors.lamps.rows(); ++f)
        factors.lamps.row(f) = directions[static_cast<std::size_t>(f)].transpose();
    Eigen::MatrixXd usable(pixels.radiance.rows(), pixels.radiance.cols());
    for (Eigen::Index p = 0; p < usable.rows(); ++p) {
        const double brightest = pixels.radiance.row(p).maxCoeff();
        for (Eigen::Index f = 0; f < usable.cols(); ++f)
            usable(p, f) = brightest > 0 && pixels.radiance(p, f) > least_of_brightest * brightest &&
                                   !factors.lamps.row(f).isZero()
                               ? 1
                               : 0;
        samples.radiance.row(p) /= std::max(brightest, 1e-12);
        if (usable.row(p).sum() < fewest_kept) usable.row(p).setZero();
    }
    samples.kept = usable;
    for (int round = 0; round < rounds; ++round) {
        factors.surface = solved(samples.radiance, samples.kept, factors.lamps);
        factors.lamps = solved(samples.radiance.transpose(), samples.kept.transpose(), factors.surface);
        if (round % trim_every == trim_every - 1) leave_out_strays(samples, usable, factors);
    }
    factors.surface = solved(samples.radiance, samples.kept, factors.lamps);
    samples.intensity = factors.lamps.rowwise().norm().cwiseMax(1e-6);
    samples.samples_per_independent = likeness(samples, factors);
    const double squares = residuals_of(samples, factors).squaredNorm(), count = samples.kept.sum();
    samples = without_empty(std::move(samples));
    const double unknowns = 3 * static_cast<double>(samples.at.size()) + 3 * static_cast<double>(usable.cols()) - 9;
    if (count <= unknowns + 1 || static_cast<double>(samples.at.size()) < fewest_per_frame) return {};
    samples.sigma = std::max(least_sigma, std::sqrt(squares / (count - unknowns)));
    return samples;
}

}  // namespace darkbox
