#pragma once

#include <opencv2/core.hpp>
#include <optional>

namespace darkbox {

/// How wide the sharpest edges of the masked picture are, as the standard deviation in pixels of a step's blur.
/// Blurring once more by s0 lowers an edge's slope by R = sqrt(1 + s0^2 / s^2), which tells s (Zhuo and Sim, Defocus
/// map estimation from a single image, Pattern Recognition 44, 2011). Thin lines count as well, too narrow by a third:
/// what is seen of one and the same thing at two times is compared by it, not one lens with another. No value where
/// fewer than `fewest_edges` pixels of edges stand out from the noise.
std::optional<double> edge_width_px(const cv::Mat1f& picture, const cv::Mat1b& mask, std::size_t fewest_edges = 20);

}  // namespace darkbox
