#include "processing/formats/ycc.h"

#include <gtest/gtest.h>

namespace darkbox {
namespace {

cv::Vec3b rgb(int luma, int cb, int cr) {
    cv::Mat2b pair(1, 2);
    pair(0, 0) = {static_cast<uchar>(luma), static_cast<uchar>(cb)};
    pair(0, 1) = {static_cast<uchar>(luma), static_cast<uchar>(cr)};
    const cv::Mat3b result = rgb_of_ycc(pair);
    EXPECT_EQ(result(0, 0), result(0, 1));
    return result(0, 0);
}

/// The colour bars at 100 % as BT.601 codes them.
TEST(Ycc, ColourBars) {
    EXPECT_EQ(rgb(16, 128, 128), cv::Vec3b(0, 0, 0));
    EXPECT_EQ(rgb(235, 128, 128), cv::Vec3b(255, 255, 255));
    EXPECT_EQ(rgb(126, 128, 128), cv::Vec3b(128, 128, 128));
    const auto near = [](const cv::Vec3b& a, const cv::Vec3b& b) { return cv::norm(a, b, cv::NORM_INF) <= 1; };
    EXPECT_TRUE(near(rgb(81, 90, 240), {255, 0, 0}));
    EXPECT_TRUE(near(rgb(145, 54, 34), {0, 255, 0}));
    EXPECT_TRUE(near(rgb(41, 240, 110), {0, 0, 255}));
}

}  // namespace
}  // namespace darkbox
