#pragma once

#include <opencv2/core.hpp>

#include "acquisition/frame/frame.h"

namespace darkbox {

/// A pixel with a sample from here on counts as clipped, in shares of full scale: sensors saturate a little early.
inline constexpr float clipping_level = 0.98F;

/// A frame as one channel of light.
struct Luminance {
    cv::Mat1f light;    ///< mean of a pixel's colours above the black level; 1 = full scale
    cv::Mat1b clipped;  ///< 255 where a colour is at full scale
};

/// Of ycc8 the luma alone; of a mosaic one value for each of its cells of two by two pixels. The frame must be whole.
Luminance luminance_of(const Frame& frame);

}  // namespace darkbox
