#pragma once

#include <opencv2/core.hpp>
#include <vector>

namespace darkbox {

/// Differences over two pixels, halved.
struct Slopes {
    cv::Mat1f dx, dy, size;
};
Slopes slopes_of(const cv::Mat1f& picture);

/// Pixels of the masked picture on the crest of an edge that is steep beside the picture's other edges and beside its
/// noise, row by row; none that the mask's own border could have made. Empty where the mask leaves fewer than
/// `fewest_pixels` pixels.
std::vector<cv::Point> strong_edges(const Slopes& slopes, const cv::Mat1b& mask, std::size_t fewest_pixels);

/// What the sharpest of these edges are like: a low quantile of their blurs, px, of which there is at least one.
double sharpest_of(std::vector<double>& blurs_px);

}  // namespace darkbox
