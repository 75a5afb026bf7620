#include "processing/calibration/reblur.h"

#include <gtest/gtest.h>

#include "tests/support/blurred_edge.h"

namespace darkbox {
namespace {

const cv::Mat1b whole_picture(100, 100, uchar{255});

TEST(EdgeWidth, IsTheEdgesOwnWidth) {
    for (const double sigma : {1.0, 1.5, 2.0, 3.0, 4.0}) {
        const auto found = edge_width_px(test::blurred_edge(sigma), whole_picture);
        ASSERT_TRUE(found) << sigma;
        EXPECT_NEAR(*found, sigma, 0.1 * sigma + 0.1);
    }
}

TEST(EdgeWidth, IsFoundInNoise) {
    for (const double sigma : {1.0, 2.0})
        EXPECT_NEAR(*edge_width_px(test::blurred_edge(sigma, 0.002), whole_picture), sigma, 0.15 * sigma);
}

TEST(EdgeWidth, OfNothingIsNotTold) {
    EXPECT_FALSE(edge_width_px(cv::Mat1f(100, 100, 0.5F), whole_picture));
    EXPECT_FALSE(edge_width_px(test::blurred_edge(1), cv::Mat1b(100, 100, uchar{0})));
}

}  // namespace
}  // namespace darkbox
