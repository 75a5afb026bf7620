#pragma once

#include <Eigen/Core>
#include <opencv2/core.hpp>

#include "processing/calibration/intensity.h"

namespace darkbox {

/// What with_intensities_of_card() makes of one frame: its light's intensity, on no common scale yet. For frames that
/// are not in memory together; with_mean_intensity_one() then brings all on one scale.
Eigen::Vector3d intensity_on_card(const cv::Mat3f& frame, const cv::Mat1b& clipped, const Light& light,
                                  const GreyCard& card);

}  // namespace darkbox
