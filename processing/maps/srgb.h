#pragma once

#include <opencv2/core.hpp>

namespace darkbox {

/// IEC 61966-2-1, on 0...1; beyond 1 the power law goes on.
float linear_from_srgb(float encoded);
float srgb_from_linear(float linear);

cv::Mat3f linear_from_srgb(const cv::Mat3f& encoded);

/// Linear radiance for looking at: times `gain`, sRGB-encoded, 8 bits, cut at 0 and 1. Still R, G, B.
cv::Mat3b viewable(const cv::Mat3f& linear, double gain = 1.0);
/// The same in 16 bits.
cv::Mat3w viewable_16(const cv::Mat3f& linear, double gain = 1.0);

/// The gain that brings the given percentile (0...100) of the brightest channel inside the mask to 1.
/// 1 for a black picture.
double viewing_gain(const cv::Mat3f& linear, const cv::Mat1b& mask, double percentile = 99.5);

}  // namespace darkbox
