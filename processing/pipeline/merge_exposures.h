#pragma once

#include <opencv2/core.hpp>
#include <vector>

#include "acquisition/session/session.h"

namespace darkbox {

/// Rows of the frames that one lamp has at one exposure.
struct ExposureRows {
    cv::Mat3f sum;          ///< of the frames' samples, sample units
    cv::Mat3f unlit;        ///< what stands there without the lamp: mean frame without a lamp, or the black level
    cv::Mat3b clipped;      ///< not 0 where any of the frames is at full scale, channel by channel
    int frames = 1;         ///< that were added up
    int unlit_frames = 1;   ///< that `unlit` is the mean of; 0: it has no noise
    double full_scale = 0;  ///< sample units
    double radiance = 1;    ///< of one sample unit, in the gauge of all exposures
    SensorNoise noise;      ///< of one frame; all zero: not known, and exposures weigh as if read noise were all
};

struct MergedRows {
    cv::Mat3f radiance;
    cv::Mat1b clipped;   ///< 255 where a channel is at full scale even in the shortest exposure
    cv::Mat3f variance;  ///< of the radiance, as the noise model predicts it
};

/// Linear radiance from exposures of one scene: the mean weighted by one over each exposure's variance, read noise and
/// shot noise together, where the shot noise is that of the radiance merged so far and not that of each noisy sample
/// itself (Granados et al., "Optimal HDR reconstruction with linear digital cameras", CVPR 2010, sections 3 and 4;
/// Hasinoff et al., "Noise-optimal capture for high dynamic range photography", CVPR 2010, section 3). An exposure is
/// left out where the shortest one predicts that it saturates: to judge by its own noisy sample would keep the dark
/// half of them. `exposures` need not be sorted; at least one.
MergedRows merge_exposures(const std::vector<ExposureRows>& exposures);

}  // namespace darkbox
