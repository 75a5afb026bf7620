#pragma once

#include <opencv2/core.hpp>
#include <optional>

namespace darkbox {

/// The standard deviation in pixels of the blur at the sharpest edges of the masked picture: what the lens does to a
/// step, at best. Blurring once more by s0 lowers an edge's slope by R = sqrt(1 + s0^2 / s^2), which tells s (Zhuo and
/// Sim, Defocus map estimation from a single image, Pattern Recognition 44, 2011). The pixels' own width is part of
/// it: a perfect edge has about 0.5. No value where no edge stands out from the noise, on
/// `fewest_edges` pixels or more.
std::optional<double> measure_blur(const cv::Mat1f& picture, const cv::Mat1b& mask, std::size_t fewest_edges = 20);

}  // namespace darkbox
