#include "rig/health/registration.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace darkbox {
namespace {

/// A scene of waves in all directions, exact at any place, seen with its origin moved to the right and down.
cv::Mat1f scene(cv::Point2d moved, double noise_sigma = 0, std::uint32_t seed = 1, double gain = 1) {
    std::mt19937 random(7);
    std::uniform_real_distribution<double> any(0, 1);
    struct Wave {
        double x, y, phase, height;
    };
    std::vector<Wave> waves;
    for (int i = 0; i < 24; ++i) {
        const double length = 8 + 60 * any(random), angle = 2 * 3.14159265 * any(random);
        waves.push_back({2 * 3.14159265 * std::cos(angle) / length, 2 * 3.14159265 * std::sin(angle) / length,
                         6.28 * any(random), 0.03});
    }
    std::mt19937 grains(seed);
    std::normal_distribution<double> noise(0, 1);
    cv::Mat1f picture(120, 160);
    for (int v = 0; v < picture.rows; ++v)
        for (int u = 0; u < picture.cols; ++u) {
            double light = 0.5;
            for (const Wave& wave : waves)
                light += wave.height * std::sin(wave.x * (u - moved.x) + wave.y * (v - moved.y) + wave.phase);
            picture(v, u) = static_cast<float>(gain * light + (noise_sigma > 0 ? noise_sigma * noise(grains) : 0));
        }
    return picture;
}

const cv::Mat1b whole_picture(120, 160, uchar{255});

TEST(Registration, FindsAnExactShift) {
    for (const cv::Point2d moved : {cv::Point2d(0, 0), cv::Point2d(0.1, 0), cv::Point2d(0.5, -0.25),
                                    cv::Point2d(-1.3, 2.7), cv::Point2d(6.4, 3.1), cv::Point2d(-15.5, 12.25)}) {
        const auto found = measure_shift(scene({0, 0}), scene(moved), whole_picture);
        ASSERT_TRUE(found) << moved;
        EXPECT_NEAR(found->px.x, moved.x, 0.005) << moved;
        EXPECT_NEAR(found->px.y, moved.y, 0.005) << moved;
        EXPECT_LT(found->sigma_px, 0.005) << moved;
    }
}

TEST(Registration, LeavesAlampsFlickerOut) {
    const auto found = measure_shift(scene({0, 0}), scene({0.3, 0}, 0, 1, 0.8), whole_picture);
    ASSERT_TRUE(found);
    EXPECT_NEAR(found->px.x, 0.3, 0.005);
}

/// Its own deviation is what repeated measurements really scatter by, without a bias towards no shift at all.
TEST(Registration, KnowsItsOwnNoise) {
    constexpr int trials = 60;
    const cv::Point2d moved(0.4, -0.2);
    double sum_x = 0, squares = 0, told = 0;
    for (std::uint32_t i = 0; i < trials; ++i) {
        const auto found = measure_shift(scene({0, 0}, 0.03, 2 * i + 1), scene(moved, 0.03, 2 * i + 2), whole_picture);
        ASSERT_TRUE(found);
        sum_x += found->px.x - moved.x;
        squares += (found->px - moved).dot(found->px - moved) / 2;
        told += found->sigma_px / trials;
    }
    const double scatter = std::sqrt(squares / trials);
    EXPECT_GT(scatter, 0.002) << "there is noise to tell";
    EXPECT_NEAR(told, scatter, 0.25 * scatter);
    EXPECT_LT(std::abs(sum_x / trials), 3.5 * scatter / std::sqrt(trials));
}

TEST(Registration, LooksWhereItIsToldTo) {
    cv::Mat1f before = scene({0, 0}), after = scene({0, 0});
    const cv::Rect left(0, 0, 90, 120);
    scene({2, 0})(left).copyTo(after(left));
    cv::Mat1b mask(120, 160, uchar{0});
    mask(cv::Rect(0, 0, 80, 120)).setTo(255);
    const auto found = measure_shift(before, after, mask);
    ASSERT_TRUE(found);
    EXPECT_NEAR(found->px.x, 2, 0.02);
    cv::Mat1b rest(120, 160, uchar{0});
    rest(cv::Rect(100, 0, 60, 120)).setTo(255);
    const auto still = measure_shift(before, after, rest);
    ASSERT_TRUE(still);
    EXPECT_NEAR(still->px.x, 0, 0.02);
}

TEST(Registration, SaysNothingOfWhatHasNoEdge) {
    EXPECT_FALSE(measure_shift(cv::Mat1f(120, 160, 0.5F), cv::Mat1f(120, 160, 0.5F), whole_picture));
    EXPECT_FALSE(measure_shift(scene({0, 0}), scene({0, 0}), cv::Mat1b(120, 160, uchar{0})));
    std::mt19937 random(3);
    std::normal_distribution<float> noise(0.5F, 0.1F);
    cv::Mat1f other(120, 160);
    for (float& value : other) value = noise(random);
    EXPECT_FALSE(measure_shift(scene({0, 0}), other, whole_picture)) << "another scene";
}

}  // namespace
}  // namespace darkbox
