#include "rig/health/sharpness.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/blurred_edge.h"

namespace darkbox {
namespace {

const cv::Mat1b everywhere(100, 100, uchar{255});

TEST(Blur, IsTheEdgesOwnWidth) {
    for (const double sigma : {1.0, 1.5, 2.0, 3.0, 4.0}) {
        const auto found = measure_blur(test::blurred_edge(sigma), everywhere);
        ASSERT_TRUE(found) << sigma;
        EXPECT_NEAR(*found, sigma, 0.1 * sigma + 0.1);
    }
}

TEST(Blur, IsFoundInNoise) {
    for (const double sigma : {1.0, 2.0})
        EXPECT_NEAR(*measure_blur(test::blurred_edge(sigma, 0.002), everywhere), sigma, 0.15 * sigma);
}

/// Thin lines beside an edge, all of them blurred alike: read as edges, they would look a third too sharp.
TEST(Blur, IsNotReadOffLines) {
    for (const double sigma : {1.5, 2.0, 3.0}) {
        cv::Mat1f picture = test::blurred_edge(sigma);
        const auto line = [&](double u) { return std::exp(-u * u / (2 * sigma * sigma)); };
        for (int v = 0; v < picture.rows; ++v)
            for (int u = 0; u < picture.cols; ++u)
                picture(v, u) += static_cast<float>(0.4 * (line(u - 12.0) + line(u - 28.0) + line(u - 85.0)));
        const auto found = measure_blur(picture, everywhere);
        ASSERT_TRUE(found) << sigma;
        EXPECT_NEAR(*found, sigma, 0.15 * sigma);
    }
}

TEST(Blur, OfNothingIsNotTold) {
    EXPECT_FALSE(measure_blur(cv::Mat1f(100, 100, 0.5F), everywhere));
    EXPECT_FALSE(measure_blur(test::blurred_edge(1), cv::Mat1b(100, 100, uchar{0})));
}

}  // namespace
}  // namespace darkbox
