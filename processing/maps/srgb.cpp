#include "processing/maps/srgb.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

namespace darkbox {
namespace {

template <class Integer>
cv::Mat_<cv::Vec<Integer, 3>> encoded(const cv::Mat3f& linear, double gain) {
    constexpr auto full = static_cast<float>(std::numeric_limits<Integer>::max());
    cv::Mat_<cv::Vec<Integer, 3>> shown(linear.size());
    const auto factor = static_cast<float>(gain);
    for (int y = 0; y < linear.rows; ++y)
        for (int x = 0; x < linear.cols; ++x)
            for (int c = 0; c < 3; ++c)
                shown(y, x)[c] = cv::saturate_cast<Integer>(full * srgb_from_linear(linear(y, x)[c] * factor));
    return shown;
}

}  // namespace

float linear_from_srgb(float encoded) {
    return encoded <= 0.04045F ? encoded / 12.92F : std::pow((encoded + 0.055F) / 1.055F, 2.4F);
}

float srgb_from_linear(float linear) {
    return linear <= 0.0031308F ? linear * 12.92F : 1.055F * std::pow(linear, 1.0F / 2.4F) - 0.055F;
}

cv::Mat3f linear_from_srgb(const cv::Mat3f& encoded) {
    cv::Mat3f linear(encoded.size());
    for (int y = 0; y < encoded.rows; ++y)
        for (int x = 0; x < encoded.cols; ++x)
            for (int c = 0; c < 3; ++c) linear(y, x)[c] = linear_from_srgb(encoded(y, x)[c]);
    return linear;
}

cv::Mat3b viewable(const cv::Mat3f& linear, double gain) { return encoded<uchar>(linear, gain); }

cv::Mat3w viewable_16(const cv::Mat3f& linear, double gain) { return encoded<ushort>(linear, gain); }

double viewing_gain(const cv::Mat3f& linear, const cv::Mat1b& mask, double percentile) {
    std::vector<float> brightest;
    for (int y = 0; y < linear.rows; ++y)
        for (int x = 0; x < linear.cols; ++x)
            if (mask.empty() || mask(y, x))
                brightest.push_back(std::max({linear(y, x)[0], linear(y, x)[1], linear(y, x)[2]}));
    if (brightest.empty()) return 1.0;
    const auto rank = static_cast<std::ptrdiff_t>(static_cast<double>(brightest.size() - 1) * percentile / 100.0);
    std::nth_element(brightest.begin(), brightest.begin() + rank, brightest.end());
    const float level = brightest[static_cast<std::size_t>(rank)];
    return level > 0 ? 1.0 / level : 1.0;
}

}  // namespace darkbox
