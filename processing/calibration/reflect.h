#pragma once

#include <Eigen/Core>
#include <opencv2/core.hpp>
#include <optional>

#include "processing/calibration/calibration.h"

namespace darkbox {

/// Pixel where the mirror image of a distant light is seen on the ball: the inverse of reflect_at(). The normal there
/// lies halfway between the light and V = (0, 0, 1). No value for light from straight behind, which is never seen.
std::optional<cv::Point2d> highlight_of(const Ball& ball, const Eigen::Vector3d& light);

}  // namespace darkbox
