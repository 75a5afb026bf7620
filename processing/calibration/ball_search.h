#pragma once

#include <opencv2/core.hpp>
#include <optional>
#include <vector>

#include "processing/calibration/calibration.h"
#include "processing/calibration/outline.h"

namespace darkbox {

/// The mirror balls in frames lit by one lamp each, to about a pixel, the surest first; none overlaps another.
/// Edge pixels of the mean frame vote for the centres they point to, radius by radius (Kimme et al. 1975, a Hough
/// transform with gradient directions). Only places where most frames show a glint can be a ball's, and the best
/// circles there are fitted to their edges. A ball's confidence is the share of its outline in view that edges support
/// times the share of frames with a lamp's glint in it. Balls stand in the light of the same lamps: a circle whose
/// glints do not lie as the surest ball's do is not one.
std::vector<Ball> find_balls(const std::vector<cv::Mat3f>& frames);
/// The same in frames that were reduced to `ball_search_side`.
std::vector<Ball> find_balls(const ReducedFrames& reduced);

inline constexpr int ball_search_side = 1024;  ///< px; the search runs on pictures no longer than this

}  // namespace darkbox
