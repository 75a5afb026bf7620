#pragma once

#include <opencv2/core.hpp>
#include <vector>

#include "processing/calibration/circle_fit.h"

namespace darkbox {

/// A lamp in front of the object (z > 0) is mirrored within sin 45 deg = 0.707 of the ball's radius; a little more is
/// looked at. What shines further out is the rim, which mirrors what stands behind the ball.
constexpr double mirror_zone = 0.75;

/// Share of frames that show one small, bright spot inside the circle, as a mirror shows a lamp; 0 when the spot stands
/// still in all of them. `images` are luminance, one per lamp.
double glint_share(const std::vector<cv::Mat1f>& images, const Circle& circle);

}  // namespace darkbox
