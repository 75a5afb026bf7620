#include "processing/shading/gain_curve.h"

#include <algorithm>
#include <cmath>

namespace darkbox {
namespace {

constexpr int fewest_samples = 3;
constexpr int fewest_lit_of_all = 4;  ///< one in four must be lit before the others are called shadowed
constexpr double shadow_share = 0.4;  ///< of Lambert's radiance; what is darker counts as shadowed

double brightness(const cv::Vec3d& colour) { return colour[0] + colour[1] + colour[2]; }

/// Replaces the gains of thin levels. `good` says which are measured.
void bridge(std::vector<cv::Vec3d>& gain, const std::vector<bool>& good) {
    const int levels = static_cast<int>(gain.size());
    int below = -1;
    for (int i = 0; i <= levels; ++i) {
        if (i < levels && !good[i]) continue;
        for (int thin = below + 1; thin < i; ++thin) {
            if (below < 0 && i == levels)
                gain[thin] = cv::Vec3d(1, 1, 1);
            else if (below < 0)
                gain[thin] = gain[i];
            else if (i == levels)
                gain[thin] = gain[below];
            else
                gain[thin] = gain[below] + (gain[i] - gain[below]) * (static_cast<double>(thin - below) / (i - below));
        }
        below = i;
    }
}

}  // namespace

void GainEstimator::Fit::add(double weight, const cv::Vec3d& lambert, const cv::Vec3d& radiance) {
    radiance_by_lambert += weight * lambert.mul(radiance);
    lambert_squared += weight * lambert.mul(lambert);
    ++samples;
}

cv::Vec3d GainEstimator::Fit::gain() const {
    cv::Vec3d gain(1, 1, 1);
    for (int c = 0; c < 3; ++c)
        if (lambert_squared[c] > 0) gain[c] = std::max(0.0, radiance_by_lambert[c] / lambert_squared[c]);
    return gain;
}

void GainEstimator::add(double r, const cv::Vec3d& albedo, const cv::Vec3d& radiance) {
    const cv::Vec3d lambert = r * albedo;
    const bool lit = brightness(radiance) >= shadow_share * brightness(lambert);
    const double position = std::min(r, 1.0) * static_cast<double>(all_.size() - 1);
    const auto below = static_cast<std::size_t>(position);
    for (std::size_t level = below; level < std::min(below + 2, all_.size()); ++level) {
        const double hat = 1.0 - std::abs(position - static_cast<double>(level));
        if (!(hat > 0)) continue;
        all_[level].add(hat, lambert, radiance);
        if (lit) lit_[level].add(hat, lambert, radiance);
    }
}

bool GainEstimator::is_lit(std::size_t level) const {
    return lit_[level].samples >= std::max(fewest_samples, all_[level].samples / fewest_lit_of_all);
}

GainCurve GainEstimator::curve() const {
    std::size_t lit_levels = 0;
    for (std::size_t level = 1; level < all_.size(); ++level) lit_levels += is_lit(level) ? 1 : 0;
    // A surface that is dark at every level is dark; one that is dark at some of them lies in shadow there.
    const std::vector<Fit>& fits = lit_levels > 0 ? lit_ : all_;

    GainCurve curve;
    std::vector<bool> good;
    for (std::size_t level = 0; level < all_.size(); ++level) {
        good.push_back(lit_levels > 0 ? is_lit(level) : all_[level].samples >= fewest_samples);
        curve.gain.push_back(fits[level].gain());
        curve.samples.push_back(good.back() ? fits[level].samples : 0);
    }
    bridge(curve.gain, good);
    return curve;
}

}  // namespace darkbox
