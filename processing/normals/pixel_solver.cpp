#include "processing/normals/pixel_solver.h"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>

namespace darkbox {
namespace {

constexpr float dark_share = 0.05F;        ///< of the upper quartile: what is darker is a shadow
constexpr float dark_deviations = 3.0F;    ///< of the noise
constexpr std::size_t enough_to_trim = 7;  ///< lit samples: fewer are not sorted into bands
constexpr float terminator_cosine =
    0.15F;                                ///< between normal and light: samples nearer the shadow's edge count nothing
constexpr float loss_deviations = 3.0F;   ///< of Geman and McClure's loss
constexpr float kept_deviations = 3.0F;   ///< the last fit: full weight within,
constexpr float lost_deviations = 6.0F;   ///< none beyond
constexpr float above_strictness = 1.5F;  ///< gloss lies above the fit only: such residuals count as this much larger
constexpr float smallest_scale = 0.002F;  ///< of |g|: no material follows a law more closely
constexpr float least_facing = -0.1F;     ///< between normal and view: what is seen does not face further away
constexpr float gloss_doubt = 0.2F;       ///< of a sample's gloss: real lobes are not quite Phong's
constexpr float deviation_per_median = 1.4826F;
constexpr float worst_reciprocal_condition = 1e-4F;  ///< of the moments of the lights kept
constexpr int reweighted_rounds = 8;

struct Band {
    float low, high;
};
constexpr std::array<Band, 6> bands{
    {{0.0F, 1.0F}, {0.2F, 0.8F}, {0.3F, 0.6F}, {0.0F, 0.7F}, {0.3F, 1.0F}, {0.5F, 0.8F}}};

float square(float x) { return x * x; }

}  // namespace

void PixelSamples::resize(std::size_t count) {
    for (std::vector<float>* plane : {&value, &noise_variance, &x, &y, &z}) plane->resize(count);
    usable.assign(count, 1);
}

void PixelSolver::prepare() {
    const std::size_t n = samples.size();
    weight_.assign(n, 0.0F);
    factor_.assign(n, 1.0F);
    residual_.assign(n, 0.0F);
    cosine_.assign(n, 0.0F);
    gloss_.assign(n, 0.0F);
    row_.resize(n);
    forget_law();
    lit_.assign(n, 0);
    order_.clear();
    scratch_.clear();
    for (std::size_t i = 0; i < n; ++i)
        if (samples.usable[i]) scratch_.push_back(samples.value[i]);
    if (scratch_.empty()) return;
    const auto quartile = scratch_.begin() + static_cast<std::ptrdiff_t>(scratch_.size() * 3 / 4);
    std::nth_element(scratch_.begin(), quartile, scratch_.end());
    const float dark = dark_share * *quartile;
    mean_noise_ = 0;
    for (std::size_t i = 0; i < n; ++i) {
        lit_[i] = samples.usable[i] && samples.value[i] > dark + dark_deviations * std::sqrt(samples.noise_variance[i]);
        if (!lit_[i]) continue;
        order_.push_back(i);
        mean_noise_ += samples.noise_variance[i];
    }
    if (order_.empty()) return;
    mean_noise_ /= static_cast<float>(order_.size());
    std::sort(order_.begin(), order_.end(), [this](std::size_t a, std::size_t b) {
        return samples.value[a] != samples.value[b] ? samples.value[a] < samples.value[b] : a < b;
    });
}

void PixelSolver::forget_law() {
    for (std::size_t i = 0; i < samples.size(); ++i) {
        factor_[i] = 1.0F;
        gloss_[i] = 0.0F;
        row_[i] = {samples.x[i], samples.y[i], samples.z[i]};
    }
}

void PixelSolver::predict(const Eigen::Vector3f& g) {
    const float length = g.norm();
    const float per_length = length > 0 ? 1.0F / length : 0.0F;
    const Eigen::Vector3f& v = samples.view;
    const float to_view = g.dot(v) * per_length;
    for (std::size_t i = 0; i < samples.size(); ++i) {
        const Eigen::Vector3f light(samples.x[i], samples.y[i], samples.z[i]);
        const float shading = g.dot(light);
        cosine_[i] = shading * per_length;
        if (!factor_of_law_->constant()) {
            factor_[i] = (*factor_of_law_)(cosine_[i], to_view, v.dot(light));
            row_[i] = factor_[i] * light;
        }
        residual_[i] = samples.value[i] - std::max(shading, 0.0F) * factor_[i];
    }
    if (gloss_law_.present() && length > 0) predict_gloss(g);
}

/// The lobe is linearised about this normal; it does not depend on the length of g.
void PixelSolver::predict_gloss(const Eigen::Vector3f& g) {
    const float length = g.norm();
    const Eigen::Vector3f normal = g / length;
    for (std::size_t i = 0; i < samples.size(); ++i) {
        const Eigen::Vector3f light(samples.x[i], samples.y[i], samples.z[i]);
        const GlossAt gloss = gloss_at(gloss_law_, normal, light, samples.view);
        gloss_[i] = gloss.value;
        row_[i] = factor_[i] * light + (gloss.slope - normal * normal.dot(gloss.slope)) / length;
        residual_[i] -= gloss.value;
    }
}

/// How far the gloss of a sample may be off, squared.
float PixelSolver::doubt_squared(std::size_t i) const { return square(gloss_doubt * gloss_[i]); }

/// Weighted least squares of value less gloss against f (g.l), f held as it is: a step of Gauss and Newton where
/// there is gloss.
std::optional<Eigen::Vector3f> PixelSolver::weighted_fit() const {
    std::array<double, 6> m{};
    std::array<double, 3> b{};
    for (std::size_t i = 0; i < samples.size(); ++i) {
        if (!(weight_[i] > 0)) continue;
        const double x = row_[i].x(), y = row_[i].y(), z = row_[i].z();
        const double w = weight_[i];
        const double v = w * static_cast<double>(samples.value[i] - gloss_[i]);
        m[0] += w * x * x;
        m[1] += w * x * y;
        m[2] += w * x * z;
        m[3] += w * y * y;
        m[4] += w * y * z;
        m[5] += w * z * z;
        b[0] += v * x;
        b[1] += v * y;
        b[2] += v * z;
    }
    Eigen::Matrix3d moments;
    moments << m[0], m[1], m[2], m[1], m[3], m[4], m[2], m[4], m[5];
    // The determinant over the cube of the mean eigenvalue: zero for lights in one plane, at most one.
    const double mean = moments.trace() / 3.0;
    if (!(moments.determinant() > static_cast<double>(worst_reciprocal_condition) * mean * mean * mean))
        return std::nullopt;
    const Eigen::Vector3d g = moments.inverse() * Eigen::Vector3d(b[0], b[1], b[2]);
    if (!g.allFinite()) return std::nullopt;
    return g.cast<float>();
}

std::optional<Eigen::Vector3f> PixelSolver::band_fit(float low, float high) {
    const auto count = static_cast<float>(order_.size());
    const auto first = static_cast<std::size_t>(low * count);
    const auto last = std::min(order_.size(), std::max(static_cast<std::size_t>(std::ceil(high * count)), first + 4));
    std::fill(weight_.begin(), weight_.end(), 0.0F);
    for (std::size_t i = first; i < last; ++i) weight_[order_[i]] = 1.0F;
    return weighted_fit();
}

/// One concentration step: least squares over the better half of the lit samples; false where that fails.
bool PixelSolver::concentrate(Eigen::Vector3f& g) {
    predict(g);
    scratch_.clear();
    for (const std::size_t i : order_) scratch_.push_back(std::abs(residual_[i]));
    const auto kept = static_cast<std::ptrdiff_t>((order_.size() + 4) / 2);
    std::nth_element(scratch_.begin(), scratch_.begin() + kept - 1, scratch_.end());
    const float limit = scratch_[static_cast<std::size_t>(kept - 1)];
    for (const std::size_t i : order_) weight_[i] = std::abs(residual_[i]) <= limit ? 1.0F : 0.0F;
    const auto better = weighted_fit();
    if (better) g = *better;
    return better.has_value();
}

/// Over the lit samples whose light stands high enough above the surface; infinite where these are too few.
float PixelSolver::median_residual(float smallest_cosine) {
    scratch_.clear();
    for (const std::size_t i : order_)
        if (cosine_[i] > smallest_cosine) scratch_.push_back(std::abs(residual_[i]));
    if (scratch_.size() < 3) return std::numeric_limits<float>::infinity();
    const auto middle = scratch_.begin() + static_cast<std::ptrdiff_t>(scratch_.size() / 2);
    std::nth_element(scratch_.begin(), middle, scratch_.end());
    return *middle;
}

std::optional<Eigen::Vector3f> PixelSolver::best_start() {
    if (order_.size() < enough_to_trim) return band_fit(0.0F, 1.0F);
    std::optional<Eigen::Vector3f> best;
    float smallest = std::numeric_limits<float>::infinity();
    for (const Band& band : bands) {
        forget_law();
        auto g = band_fit(band.low, band.high);
        if (!g || !concentrate(*g) || !concentrate(*g)) continue;
        predict(*g);
        const float median = median_residual(-1.0F);
        if (median < smallest) {
            smallest = median;
            best = g;
        }
    }
    if (best) return best;
    forget_law();
    return band_fit(0.0F, 1.0F);
}

SampleUse PixelSolver::use(std::size_t i) const {
    if (!samples.usable[i]) return SampleUse::clipped;
    if (weight_[i] > 0) return SampleUse::kept;
    const bool faces_light = lit_[i] && cosine_[i] > terminator_cosine;
    return faces_light && residual_[i] > 0 ? SampleUse::highlight : SampleUse::shadow;
}

std::vector<float> PixelSolver::lit_residuals() const {
    std::vector<float> residuals;
    for (const std::size_t i : order_)
        if (cosine_[i] > terminator_cosine) residuals.push_back(residual_[i]);
    return residuals;
}

float misfit(const std::vector<float>& residuals, float scale) {
    if (residuals.empty()) return 1.0F;
    double loss = 0;
    for (const float residual : residuals) {
        const float t = square(residual / (loss_deviations * scale));
        loss += static_cast<double>(t / (1.0F + t));
    }
    return static_cast<float>(loss / static_cast<double>(residuals.size()));
}

PixelFit PixelSolver::finish(const Eigen::Vector3f& g, float variance) {
    predict(g);
    PixelFit fit{g, variance, 0};
    double squares = 0, total = 0;
    for (std::size_t i = 0; i < samples.size(); ++i) {
        if (!(weight_[i] > 0)) continue;
        ++fit.used;
        total += 1.0;
        squares += static_cast<double>(square(residual_[i]));
    }
    if (total > 3) fit.variance = static_cast<float>(squares / (total - 3));
    fit.variance = std::max(fit.variance, mean_noise_);
    return fit;
}

std::optional<PixelFit> PixelSolver::solve(const BodyFactor& factor, const GlossLaw& gloss) {
    prepare();
    factor_of_law_ = &factor;
    gloss_law_ = gloss;
    auto start = best_start();
    if (!start) return solve_least_squares();
    Eigen::Vector3f g = *start;
    scale_ = 0;
    for (int round = 0; round < reweighted_rounds + 2; ++round) {
        predict(g);
        const float median = median_residual(terminator_cosine);
        if (!std::isfinite(median)) break;
        const auto n = static_cast<float>(scratch_.size());
        const float spread = deviation_per_median * median * std::sqrt(n / std::max(n - 3.0F, 1.0F));
        scale_ = std::max({spread, std::sqrt(mean_noise_), smallest_scale * g.norm()});
        const bool last = round >= reweighted_rounds;
        for (std::size_t i = 0; i < samples.size(); ++i) {
            weight_[i] = 0;
            if (!lit_[i] || !(cosine_[i] > terminator_cosine)) continue;
            const float doubt = doubt_squared(i), spread_squared = square(scale_) + doubt;
            const float strictness = residual_[i] > 0 ? above_strictness : 1.0F;
            const float t = std::abs(residual_[i]) * strictness / std::sqrt(spread_squared);
            if (last) {
                const float taper = std::clamp((lost_deviations - t) / (lost_deviations - kept_deviations), 0.0F, 1.0F);
                weight_[i] = taper * square(scale_) / (spread_squared - mean_noise_ + samples.noise_variance[i]);
            } else {
                weight_[i] = square(scale_) / (spread_squared * square(1.0F + square(t / loss_deviations)));
            }
        }
        const auto better = weighted_fit();
        if (!better) break;
        g = *better;
    }
    if (!(g.norm() > 0)) return std::nullopt;
    if (g.dot(samples.view) < least_facing * g.norm()) return solve_least_squares();
    return finish(g, square(scale_));
}

std::optional<PixelFit> PixelSolver::solve_least_squares() {
    static const BodyFactor lambert{BodyLaw{}};
    prepare();
    factor_of_law_ = &lambert;
    gloss_law_ = {};
    for (std::size_t i = 0; i < samples.size(); ++i) weight_[i] = samples.usable[i] ? 1.0F : 0.0F;
    const auto g = weighted_fit();
    if (!g || !(g->norm() > 0)) return std::nullopt;
    return finish(*g, mean_noise_);
}

}  // namespace darkbox
