#pragma once

#include <opencv2/core.hpp>

#include "processing/calibration/circle_fit.h"
#include "processing/maps/maps.h"

namespace darkbox {

/// What a mask says of a ball: the truth that a capture of a matte ball brings with it.
struct IdealSphere {
    Circle outline;        ///< pixels
    double spread_px = 0;  ///< robust standard deviation of the outline's distance to the circle
    NormalMap normals;     ///< of the sphere seen orthographically; valid inside both circle and mask
};

/// The circle through the borders between pixels inside and outside the mask (halfway between their centres; the
/// picture's own border does not count), fitted robustly. Throws InputError when the outline is not a circle.
IdealSphere ideal_sphere(const cv::Mat1b& mask);

}  // namespace darkbox
