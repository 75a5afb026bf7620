#pragma once

#include <opencv2/core.hpp>

namespace darkbox {

/// Rows of luma and shared chroma (PixelFormat::ycc8, CV_8UC2 of an even width) as R, G, B, CV_8UC3, by Rec. ITU-R
/// BT.601 in its limited range: luma 16 to 235 becomes 0 to 255. Two pixels share their chroma; luma at 235 or above
/// comes out clipped. The samples stay encoded for display, as they were.
cv::Mat3b rgb_of_ycc(const cv::Mat2b& ycc);

}  // namespace darkbox
