#include "processing/shading/gain_curve.h"

#include <algorithm>
#include <cmath>

namespace darkbox {
namespace {

constexpr int fewest_samples = 3;
constexpr int fewest_lit_of_all = 4;  ///< one in four must be lit before the others are called shadowed
constexpr double shadow_share = 0.4;  ///< of Lambert's radiance; what is darker counts as shadowed
constexpr double tie = 1.0;           ///< between neighbouring gains, in samples that face the light

double brightness(const cv::Vec3d& colour) { return colour[0] + colour[1] + colour[2]; }

/// Symmetric tridiagonal equations in the gains of levels 1...n; that of level 0 has no weight in S.
struct Equations {
    std::vector<double> diagonal, beside, right;  ///< beside[i] joins i and i + 1

    explicit Equations(std::size_t unknowns) : diagonal(unknowns, 0), beside(unknowns, 0), right(unknowns, 0) {}

    void tie_neighbours(double weight) {
        for (std::size_t i = 0; i + 1 < diagonal.size(); ++i) {
            diagonal[i] += weight;
            diagonal[i + 1] += weight;
            beside[i] -= weight;
        }
    }

    /// Elimination without pivoting: the equations are positive definite once there is a sample.
    std::vector<double> solution() const {
        std::vector<double> pivot = diagonal, x = right;
        for (std::size_t i = 1; i < x.size(); ++i) {
            const double factor = beside[i - 1] / pivot[i - 1];
            pivot[i] -= factor * beside[i - 1];
            x[i] -= factor * x[i - 1];
        }
        for (std::size_t i = x.size(); i-- > 0;) {
            if (i + 1 < x.size()) x[i] -= beside[i] * x[i + 1];
            x[i] /= pivot[i];
        }
        return x;
    }
};

/// Where a level has no samples of its own, S must not fall below the level before it.
void keep_rising_where_thin(GainCurve& curve) {
    for (std::size_t i = 2; i < curve.gain.size(); ++i) {
        if (curve.samples[i] > 0) continue;
        const double fall = static_cast<double>(i - 1) / static_cast<double>(i);
        for (int c = 0; c < 3; ++c) curve.gain[i][c] = std::max(curve.gain[i][c], fall * curve.gain[i - 1][c]);
    }
}

}  // namespace

cv::Vec3d GainCurve::shading(double r) const {
    const double intervals = static_cast<double>(gain.size() - 1);
    const double position = std::clamp(r, 0.0, 1.0) * intervals;
    const auto below = std::min(static_cast<std::size_t>(position), gain.size() - 2);
    const double fraction = position - static_cast<double>(below);
    return ((1 - fraction) * static_cast<double>(below) * gain[below] +
            fraction * static_cast<double>(below + 1) * gain[below + 1]) *
           (1 / intervals);
}

void GainEstimator::add(double r, const cv::Vec3d& albedo, const cv::Vec3d& radiance) {
    const bool lit = brightness(radiance) >= shadow_share * r * brightness(albedo);
    const auto intervals = static_cast<double>(all_.size());
    const double position = std::min(r, 1.0) * intervals;
    const auto interval = std::min(static_cast<std::size_t>(position), all_.size() - 1);
    const double fraction = position - static_cast<double>(interval);
    const cv::Vec3d below = albedo * ((1 - fraction) * static_cast<double>(interval) / intervals);
    const cv::Vec3d above = albedo * (fraction * static_cast<double>(interval + 1) / intervals);
    for (std::vector<Interval>* fits : {&all_, &lit_}) {
        if (fits == &lit_ && !lit) continue;
        Interval& fit = (*fits)[interval];
        fit.below_squared += below.mul(below);
        fit.cross += below.mul(above);
        fit.above_squared += above.mul(above);
        fit.below_radiance += below.mul(radiance);
        fit.above_radiance += above.mul(radiance);
        fit.albedo_squared += albedo.mul(albedo);
        ++fit.samples;
        if (fraction > 0) ++fit.samples_above;
    }
}

bool GainEstimator::is_lit(std::size_t interval) const {
    return lit_[interval].samples >= std::max(fewest_samples, all_[interval].samples / fewest_lit_of_all);
}

bool GainEstimator::is_dark_throughout() const {
    for (std::size_t i = 0; i < all_.size(); ++i)
        if (is_lit(i)) return false;
    return true;
}

std::vector<GainEstimator::Interval> GainEstimator::measured() const {
    const bool dark = is_dark_throughout();
    std::vector<Interval> fits = dark ? all_ : lit_;
    for (std::size_t i = 0; i < fits.size(); ++i)
        if (dark ? fits[i].samples < fewest_samples : !is_lit(i)) fits[i] = {};
    return fits;
}

GainCurve GainEstimator::curve() const {
    const std::vector<Interval> fits = measured();
    GainCurve curve{std::vector<cv::Vec3d>(fits.size() + 1, cv::Vec3d(1, 1, 1)), std::vector<int>(fits.size() + 1, 0)};
    int samples = 0;
    cv::Vec3d albedo_squared(0, 0, 0);
    for (std::size_t i = 0; i < fits.size(); ++i) {
        curve.samples[i] += fits[i].samples;
        curve.samples[i + 1] += fits[i].samples_above;
        samples += fits[i].samples;
        albedo_squared += fits[i].albedo_squared;
    }
    for (int c = 0; c < 3; ++c) {
        if (!(albedo_squared[c] > 0)) continue;
        Equations equations(fits.size());
        for (std::size_t i = 0; i < fits.size(); ++i) {
            equations.diagonal[i] += fits[i].above_squared[c];
            equations.right[i] += fits[i].above_radiance[c];
            if (i == 0) continue;
            equations.diagonal[i - 1] += fits[i].below_squared[c];
            equations.beside[i - 1] += fits[i].cross[c];
            equations.right[i - 1] += fits[i].below_radiance[c];
        }
        equations.tie_neighbours(tie * albedo_squared[c] / samples);
        const std::vector<double> gains = equations.solution();
        for (std::size_t i = 0; i < gains.size(); ++i) curve.gain[i + 1][c] = std::max(0.0, gains[i]);
        curve.gain[0][c] = curve.gain[1][c];
    }
    keep_rising_where_thin(curve);
    return curve;
}

}  // namespace darkbox
