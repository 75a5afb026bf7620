#pragma once

#include <opencv2/core.hpp>
#include <vector>

namespace darkbox {

/// How a texel's radiance at each level compares to Lambert's, per channel: S(k, r_i) = mean albedo x r_i x gain[i].
struct GainCurve {
    std::vector<cv::Vec3d> gain;  ///< at least 0; 1 = Lambert
    std::vector<int> samples;     ///< behind each level; 0 where its gain comes from other levels
};

/// Samples of one texel re-sampled at the levels r_i = i / (levels - 1). A sample is set against its own pixel's
/// albedo, so that a texel of mixed albedo, lit unevenly, does not take albedo for shading. The gain of a level is the
/// least-squares factor of albedo x r over the samples within one level's distance, weighted by the hat about the
/// level. Samples far below Lambert's prediction are shadowed and left out, unless the texel is that dark at all
/// levels. Levels with thin data are interpolated in gain; beyond the last good level its gain holds, which scales the
/// radiance with r. Thread-compatible.
class GainEstimator {
public:
    explicit GainEstimator(int levels) : lit_(levels), all_(levels) {}

    /// One photograph's view of a pixel: `r` = N.L in (0, 1], `radiance` for a light of intensity 1.
    void add(double r, const cv::Vec3d& albedo, const cv::Vec3d& radiance);

    GainCurve curve() const;

private:
    /// Normal equations of a level's one unknown per channel.
    struct Fit {
        cv::Vec3d radiance_by_lambert{0, 0, 0};
        cv::Vec3d lambert_squared{0, 0, 0};
        int samples = 0;

        void add(double weight, const cv::Vec3d& lambert, const cv::Vec3d& radiance);
        cv::Vec3d gain() const;
    };

    /// Enough samples, and enough of them not shadowed.
    bool is_lit(std::size_t level) const;

    std::vector<Fit> lit_;  ///< of samples that are not shadowed
    std::vector<Fit> all_;
};

}  // namespace darkbox
