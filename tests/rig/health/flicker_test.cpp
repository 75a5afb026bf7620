#include "rig/health/flicker.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace darkbox {
namespace {

/// Frames of grey at these levels with noise of this standard deviation.
std::optional<Flicker> flicker_of(const std::vector<double>& levels, double sigma) {
    std::mt19937 random(1);
    std::normal_distribution<float> noise(0, static_cast<float>(sigma));
    FlickerMeter meter;
    for (const double level : levels) {
        Luminance picture{cv::Mat1f(100, 100), cv::Mat1b(100, 100, uchar{0})};
        for (float& value : picture.light) value = static_cast<float>(level) + (sigma > 0 ? noise(random) : 0.0F);
        meter.add(picture);
    }
    return meter.result();
}

std::vector<double> swinging(double share, int count) {
    std::vector<double> levels;
    for (int i = 0; i < count; ++i) levels.push_back(0.5 * (1 + (i % 2 ? share : -share)));
    return levels;
}

TEST(Flicker, OfSteadyLightIsNone) {
    const auto found = flicker_of(std::vector<double>(10, 0.5), 0);
    ASSERT_TRUE(found);
    EXPECT_NEAR(found->rms, 0, 1e-6);
    EXPECT_EQ(found->frames, 10U);
}

TEST(Flicker, IsTheStandardDeviationOfTheLight) {
    const auto found = flicker_of(swinging(0.01, 64), 0);
    ASSERT_TRUE(found);
    EXPECT_NEAR(found->rms, 0.01, 1e-4);
}

/// 10,000 pixels with 2 % noise: a mean is sure to 0.04 % of a level of 0.5.
TEST(Flicker, LeavesNoiseOut) {
    const auto steady = flicker_of(std::vector<double>(64, 0.5), 0.02);
    ASSERT_TRUE(steady);
    EXPECT_NEAR(steady->noise, 4e-4, 0.5e-4);
    EXPECT_LT(steady->rms, 4e-4);
    EXPECT_NEAR(flicker_of(swinging(0.005, 64), 0.02)->rms, 0.005, 3e-4);
}

TEST(Flicker, NeedsLightAndThreeFrames) {
    EXPECT_FALSE(flicker_of({0.5, 0.5}, 0));
    EXPECT_FALSE(flicker_of({0.0, 0.0, 0.0, 0.0}, 0));
}

}  // namespace
}  // namespace darkbox
