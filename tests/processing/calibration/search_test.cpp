#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>

#include "processing/calibration/ball_search.h"
#include "tests/processing/calibration/ball_scene.h"

namespace darkbox {
namespace {

using test::BallScene;
using test::dome_of_lights;
using test::photographs;

std::vector<Ball> found_in(const BallScene& scene) {
    std::vector<Ball> balls = find_balls(photographs(scene, dome_of_lights(9)));
    for (const Ball& b : balls)
        fmt::print("ball {:.2f} {:.2f} radius {:.2f}, confidence {:.2f}\n", b.x, b.y, b.radius, b.confidence);
    return balls;
}

bool is(const Ball& found, const Ball& truth, double tolerance) {
    return std::hypot(found.x - truth.x, found.y - truth.y) < tolerance &&
           std::abs(found.radius - truth.radius) < tolerance;
}

TEST(FindBalls, AllOfThemAndNothingElse) {
    BallScene scene;
    scene.size = {480, 300};
    scene.checks = 9;
    scene.ball = {300.3, 150.6, 60.2, 1.0};
    scene.more_balls = {{420.7, 80.2, 30.4, 1.0}, {430.1, 240.8, 16.3, 1.0}};
    const auto balls = found_in(scene);
    ASSERT_EQ(balls.size(), 3U);
    for (const Ball& truth : {scene.ball, scene.more_balls[0], scene.more_balls[1]})
        EXPECT_EQ(std::count_if(balls.begin(), balls.end(), [&](const Ball& b) { return is(b, truth, 1.0); }), 1);
    for (std::size_t i = 0; i < 3; ++i) EXPECT_GT(balls[i].confidence, 0.7);
    EXPECT_GE(balls[0].confidence, balls[1].confidence);
    EXPECT_GE(balls[1].confidence, balls[2].confidence);
}

TEST(FindBalls, RoundMatteObjectIsNone) {
    BallScene scene;
    scene.ball = {-500, -500, 20, 1.0};
    EXPECT_TRUE(found_in(scene).empty());
    scene.checks = 7;
    scene.noise = 0.01;
    EXPECT_TRUE(found_in(scene).empty());
}

TEST(FindBalls, SmallAndNoisy) {
    BallScene scene;
    scene.ball = {290.4, 60.7, 11.2, 1.0};
    scene.noise = 0.01;
    const auto balls = found_in(scene);
    ASSERT_EQ(balls.size(), 1U);
    EXPECT_TRUE(is(balls[0], scene.ball, 1.0));
}

TEST(FindBalls, CutByTheBorder) {
    BallScene scene;
    scene.ball = {330.4, 140.7, 50.2, 1.0};
    const auto balls = found_in(scene);
    ASSERT_EQ(balls.size(), 1U);
    EXPECT_TRUE(is(balls[0], scene.ball, 1.0));
}

TEST(FindBalls, DarkBallInABlackBox) {
    BallScene scene;
    scene.wall = 0.004;
    scene.room = 0.05;
    scene.noise = 0.004;  // 0.0007 in the mean of 9 frames and 3 channels; the outline is 0.003 high
    const auto balls = found_in(scene);
    ASSERT_EQ(balls.size(), 1U);
    EXPECT_TRUE(is(balls[0], scene.ball, 1.5));
}

TEST(FindBalls, FewerGlintsMeanLessConfidence) {
    const auto lights = dome_of_lights(9);
    auto frames = photographs({}, lights);
    BallScene dark;
    dark.lamp_radiance = 0;
    for (std::size_t i = 0; i < 3; ++i) frames[i] = photograph(dark, lights[i]);
    const auto balls = find_balls(frames);
    ASSERT_EQ(balls.size(), 1U);
    EXPECT_NEAR(balls[0].confidence, 6 / 9.0, 0.1);
}

}  // namespace
}  // namespace darkbox
