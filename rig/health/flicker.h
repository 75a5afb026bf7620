#pragma once

#include <optional>
#include <vector>

#include "rig/health/luminance.h"

namespace darkbox {

struct Flicker {
    double rms = 0;    ///< standard deviation of a frame's light from frame to frame, noise taken away, over its mean
    double noise = 0;  ///< what noise alone lets it seem to be
    std::size_t frames = 0;
};

/// How steady a lamp's light is from one exposure to the next. Pixels that clip, and dark ones, are left out.
/// Thread-compatible.
class FlickerMeter {
public:
    void add(const Luminance& picture);
    /// No value before there were three frames, or when nothing was lit.
    std::optional<Flicker> result() const;

private:
    cv::Mat1b used_;
    cv::Mat1f before_;
    std::vector<double> means_;
    double noise_sum_ = 0;  ///< of a frame's mean: variances that pairs of frames tell
};

}  // namespace darkbox
