#pragma once

#include <opencv2/core.hpp>
#include <optional>
#include <vector>

#include "processing/calibration/calibration.h"

namespace darkbox {

/// The mirror ball in frames lit by one lamp each, to about a pixel; no value where nothing looks like one.
/// Edge pixels of the mean frame vote for the centres they point to, radius by radius (Kimme et al. 1975, a Hough
/// transform with gradient directions); the best circles are fitted to their edges, and each is judged by the share of
/// its outline that has edges times the share of frames with a lamp's glint in it.
std::optional<Ball> find_ball(const std::vector<cv::Mat3f>& frames);

}  // namespace darkbox
