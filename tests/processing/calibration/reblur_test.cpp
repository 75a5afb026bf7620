#include "processing/calibration/reblur.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

namespace darkbox {
namespace {

/// A bright half plane whose edge is a Gaussian's integral of this width.
cv::Mat1f half_plane(double sigma, double noise_sigma = 0) {
    std::mt19937 random(1);
    std::normal_distribution<float> noise(0, static_cast<float>(noise_sigma));
    cv::Mat1f picture(100, 100);
    for (int v = 0; v < 100; ++v)
        for (int u = 0; u < 100; ++u) {
            const double across = (u - 50.3) * std::cos(0.3) + (v - 49.7) * std::sin(0.3);
            picture(v, u) = static_cast<float>(0.1 + 0.25 * (1 + std::erf(across / sigma / std::numbers::sqrt2)));
            if (noise_sigma > 0) picture(v, u) += noise(random);
        }
    return picture;
}

const cv::Mat1b whole_picture(100, 100, uchar{255});

TEST(EdgeWidth, IsTheEdgesOwnWidth) {
    for (const double sigma : {1.0, 1.5, 2.0, 3.0, 4.0}) {
        const auto found = edge_width_px(half_plane(sigma), whole_picture);
        ASSERT_TRUE(found) << sigma;
        EXPECT_NEAR(*found, sigma, 0.1 * sigma + 0.1);
    }
}

TEST(EdgeWidth, IsFoundInNoise) {
    for (const double sigma : {1.0, 2.0})
        EXPECT_NEAR(*edge_width_px(half_plane(sigma, 0.002), whole_picture), sigma, 0.15 * sigma);
}

TEST(EdgeWidth, OfNothingIsNotTold) {
    EXPECT_FALSE(edge_width_px(cv::Mat1f(100, 100, 0.5F), whole_picture));
    EXPECT_FALSE(edge_width_px(half_plane(1), cv::Mat1b(100, 100, uchar{0})));
}

}  // namespace
}  // namespace darkbox
