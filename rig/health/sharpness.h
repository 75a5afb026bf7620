#pragma once

#include <opencv2/core.hpp>
#include <optional>

namespace darkbox {

/// The standard deviation in pixels of the blur at the sharpest steps of the masked picture: what the lens does to an
/// edge, at best. A step that a Gaussian blurred is as high as its steepest slope times s sqrt(2 pi). Lines are no
/// steps and are left out: a line blurred by s has the slopes of a step blurred by two thirds of that, at any scale.
/// The pixels' own width is part of it: a perfect edge has about 0.3. What has no sharp edge of its own reads as
/// blurred. No value where no step stands out from the noise.
std::optional<double> measure_blur(const cv::Mat1f& picture, const cv::Mat1b& mask);

}  // namespace darkbox
