#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <optional>
#include <vector>

#include "processing/normals/body_law.h"
#include "processing/normals/gloss_law.h"
#include "processing/normals/sample_use.h"

namespace darkbox {

/// The samples of one pixel, each brought to a light of irradiance 1 at this pixel.
struct PixelSamples {
    void resize(std::size_t count);
    std::size_t size() const { return value.size(); }

    std::vector<float> value;           ///< mean over channels, linear radiance
    std::vector<float> noise_variance;  ///< of `value`; 0 where not known
    std::vector<float> x, y, z;         ///< unit direction to the light
    std::vector<char> usable;           ///< 0: clipped
    Eigen::Vector3f view{0, 0, 1};      ///< unit direction to the camera
};

struct PixelFit {
    Eigen::Vector3f g{0, 0, 0};  ///< albedo times normal
    float variance = 0;          ///< of a sample about the fit, over the samples kept; never below the noise's
    int used = 0;                ///< samples kept
};

/// Fits g = albedo times normal to one pixel's samples and says how much each of them counts. Owns buffers that it
/// uses again for each pixel: one solver per thread. Thread-compatible.
///
/// The model of a sample: value = (g.l) f + gloss + noise, f the body's factor; gloss, where its law is known, depends
/// on the normal, and each fit is a step of Gauss and Newton. Gloss is trusted to a fifth of itself: samples deep in a
/// highlight count little, those at its foot are corrected. Some samples do not follow the model: shadows, attached or
/// cast, lie below; highlights that the law does not know lie above.
/// 1. Samples that are dark against the pixel's upper quartile are shadows.
/// 2. Starts: least squares over several bands of the sorted lit samples (position thresholds after Shi, Tan,
/// Matsushita
///    and Ikeuchi, PAMI 36(6) 2014), each improved by two concentration steps of least trimmed squares (Rousseeuw and
///    Van Driessen 1999); the start with the smallest median of absolute residuals goes on.
/// 3. Reweighted least squares with Geman and McClure's loss, its scale from the median of absolute residuals; samples
///    near the attached shadow's edge count nothing, and what lies above the fit, where gloss is, is judged more
///    strictly.
/// 4. Last, least squares over what lies within a few deviations, weighted by noise: where every sample agrees this is
///    the efficient estimate.
/// A fit that faces away from the camera is not what the camera sees: least squares over all stands in for it.
/// With fewer than seven lit samples only steps 3 and 4 are left, from least squares over all.
class PixelSolver {
public:
    PixelSamples samples;

    /// None where the samples do not determine a normal.
    std::optional<PixelFit> solve(const BodyFactor& factor, const GlossLaw& gloss = {});
    /// Plain least squares over all usable samples with Lambert's law; none where they do not determine a normal.
    std::optional<PixelFit> solve_least_squares();

    /// After a solve: each sample's weight (relative), and the body's factor in its direction.
    const std::vector<float>& weights() const { return weight_; }
    const std::vector<float>& factors() const { return factor_; }
    /// After a solve that gave a normal.
    SampleUse use(std::size_t i) const;
    /// After a solve: value less the fit.
    float residual(std::size_t i) const { return residual_[i]; }
    float cosine(std::size_t i) const { return cosine_[i]; }
    float gloss(std::size_t i) const { return gloss_[i]; }  ///< that the fit says is in the sample
    /// The derivative of the sample's fit along g.
    const Eigen::Vector3f& derivative(std::size_t i) const { return row_[i]; }
    /// After solve(): the residuals of the lit samples away from the attached shadow's edge.
    std::vector<float> lit_residuals() const;
    /// After solve(): the robust standard deviation that the last reweighting used.
    float scale() const { return scale_; }

private:
    void prepare();
    void forget_law();
    void predict(const Eigen::Vector3f& g);
    void predict_gloss(const Eigen::Vector3f& g);
    std::optional<Eigen::Vector3f> weighted_fit() const;
    std::optional<Eigen::Vector3f> best_start();
    std::optional<Eigen::Vector3f> band_fit(float low, float high);
    bool concentrate(Eigen::Vector3f& g);
    float median_residual(float smallest_cosine);
    float doubt_squared(std::size_t i) const;
    PixelFit finish(const Eigen::Vector3f& g, float variance);

    const BodyFactor* factor_of_law_ = nullptr;  ///< of the solve() that runs
    GlossLaw gloss_law_;
    std::vector<float> weight_, factor_, residual_, cosine_, gloss_;
    std::vector<Eigen::Vector3f> row_;  ///< derivative of a sample along g
    std::vector<char> lit_;
    std::vector<std::size_t> order_;  ///< of the lit samples, darkest first
    std::vector<float> scratch_;
    float mean_noise_ = 0;
    float scale_ = 0;
};

/// The mean of Geman and McClure's loss of residuals for this scale, 0 to 1; 1 where there is none.
float misfit(const std::vector<float>& residuals, float scale);

}  // namespace darkbox
