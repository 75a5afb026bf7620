#pragma once

#include <cmath>
#include <opencv2/core.hpp>
#include <optional>

namespace darkbox {

/// How far a picture lies from an earlier one of the same scene.
struct Shift {
    cv::Point2d px;       ///< to the right and down
    double sigma_px = 0;  ///< standard deviation of each of the two
    double length() const { return std::hypot(px.x, px.y); }
};

/// The shift by which `after` is most like `before`, any gain and offset of the light allowed, where `mask` (of
/// `before`) is 255: Lucas and Kanade's iteration ("An iterative image registration technique", IJCAI 1981) from coarse
/// to fine, up to some 20 pixels. Its deviation is told by leaving out one block of the picture after the other
/// (jackknife), so that noise, and things that moved by themselves, are in it. No value where too little in the picture
/// has an edge, or the pictures do not agree in any place.
std::optional<Shift> measure_shift(const cv::Mat1f& before, const cv::Mat1f& after, const cv::Mat1b& mask);

}  // namespace darkbox
