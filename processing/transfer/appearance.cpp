#include "processing/transfer/appearance.h"

#include <algorithm>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "processing/maps/srgb.h"

namespace darkbox {

Appearance appearance_of(const NormalMap& normals, const AlbedoMap& albedo, float white) {
    Appearance result{normals, viewable(albedo.albedo, 1 / static_cast<double>(white))};
    cv::bitwise_and(normals.valid, albedo.valid, result.normals.valid = cv::Mat1b());
    return result;
}

float white_level(const AlbedoMap& albedo) {
    std::vector<float> brightest;
    for (int y = 0; y < albedo.valid.rows; ++y)
        for (int x = 0; x < albedo.valid.cols; ++x) {
            const cv::Vec3f& v = albedo.albedo(y, x);
            if (albedo.valid(y, x)) brightest.push_back(std::max({v[0], v[1], v[2]}));
        }
    if (brightest.empty()) return 1.0F;
    const auto rank = static_cast<std::ptrdiff_t>(0.99 * static_cast<double>(brightest.size() - 1));
    std::nth_element(brightest.begin(), brightest.begin() + rank, brightest.end());
    const float level = brightest[static_cast<std::size_t>(rank)];
    return level > 0 ? level : 1.0F;
}

cv::Mat1b inner_pixels(const cv::Mat1b& valid, int radius) {
    cv::Mat1b inner;
    cv::erode(valid, inner, cv::Mat1b(2 * radius + 1, 2 * radius + 1, std::uint8_t{1}), cv::Point(-1, -1), 1,
              cv::BORDER_CONSTANT, cv::Scalar(0));
    return inner;
}

}  // namespace darkbox
