#pragma once

#include <opencv2/core.hpp>

#include "processing/maps/maps.h"

namespace darkbox {

/// Every texel in a colour of its own, the outside black.
cv::Mat3b false_colours(const IndexMap& index);

/// 0 black, over red and yellow, to `top` white; outside the mask black.
cv::Mat3b heat(const cv::Mat1f& values, const cv::Mat1b& mask, double top);

/// Normals as people know them: red = x, green = y (up), blue = z, 8 bits.
cv::Mat3b normal_colours(const NormalMap& normals);

}  // namespace darkbox
