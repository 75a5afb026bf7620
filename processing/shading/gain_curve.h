#pragma once

#include <cstddef>
#include <opencv2/core.hpp>
#include <vector>

namespace darkbox {

/// How a texel's radiance at each level compares to Lambert's, per channel: S(k, r_i) = mean albedo x r_i x gain[i].
struct GainCurve {
    std::vector<cv::Vec3d> gain;  ///< at least 0; 1 = Lambert
    std::vector<int> samples;     ///< behind each level; 0 where its gain comes from other levels

    /// S(k, r) for an albedo of 1, by linear interpolation between the levels; r in 0...1.
    cv::Vec3d shading(double r) const;
};

/// Fits one texel's S(k, r) to its samples. A sample is set against its own pixel's albedo, so that a texel of mixed
/// albedo, lit unevenly, does not take albedo for shading. S is the piecewise linear function of r that misses the
/// samples least (least squares on radiance: as relighting interpolates, so it is fitted), and neighbouring levels are
/// tied to like gains as firmly as a few samples would: a gap is bridged linearly in gain, and beyond the last sample
/// the gain holds, which scales the radiance with r.
///
/// Samples far below Lambert's prediction are shadowed and left out, unless the texel is that dark at all r; so are
/// those between two levels where too few, or too few of them lit, were seen. Thread-compatible.
class GainEstimator {
public:
    explicit GainEstimator(int levels) : lit_(levels - 1), all_(levels - 1) {}

    /// One photograph's view of a pixel: `r` = N.L in (0, 1], `radiance` for a light of intensity 1.
    void add(double r, const cv::Vec3d& albedo, const cv::Vec3d& radiance);

    GainCurve curve() const;

    /// Memory of one with so many levels.
    static std::size_t bytes(int levels) { return 2 * static_cast<std::size_t>(levels - 1) * sizeof(Interval); }

private:
    /// Normal equations of the gains at both ends of the interval between two levels.
    struct Interval {
        cv::Vec3d below_squared{0, 0, 0}, cross{0, 0, 0}, above_squared{0, 0, 0};
        cv::Vec3d below_radiance{0, 0, 0}, above_radiance{0, 0, 0};
        cv::Vec3d albedo_squared{0, 0, 0};
        int samples = 0;
        int samples_above = 0;  ///< that have a share in the upper level
    };

    /// Enough samples, and enough of them not shadowed.
    bool is_lit(std::size_t interval) const;
    /// A surface that is dark at every r is dark; one that is dark at some of them lies in shadow there.
    bool is_dark_throughout() const;
    /// The intervals' equations that count; without samples where they do not.
    std::vector<Interval> measured() const;

    std::vector<Interval> lit_;  ///< of samples that are not shadowed
    std::vector<Interval> all_;
};

}  // namespace darkbox
