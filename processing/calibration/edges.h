#pragma once

#include <opencv2/core.hpp>
#include <vector>

namespace darkbox {

/// A pixel on an edge and the unit direction across it.
struct Edge {
    cv::Point2d at;
    cv::Point2d across;
};

/// Ridges of the gradient's magnitude that stand out of the noise of the picture's quietest quarter, one pixel wide.
std::vector<Edge> find_edges(const cv::Mat1f& image);

}  // namespace darkbox
