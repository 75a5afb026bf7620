#include "processing/calibration/highlight.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>

#include "processing/calibration/reflect.h"
#include "tests/processing/calibration/ball_scene.h"

namespace darkbox {
namespace {

using test::BallScene;
using test::dome_of_lights;
using test::photographs;

BallScene only_a_ball(double radius, double lamp_radiance, double noise) {
    BallScene scene;
    const int side = static_cast<int>(2.4 * radius);
    scene.size = {side, side};
    scene.ball = {1.2 * radius + 0.3, 1.2 * radius - 0.2, radius, 1.0};
    scene.lamp_radius_deg = 3.4;
    scene.lamp_radiance = lamp_radiance;
    scene.noise = noise;
    scene.rays_per_pixel_side = 8;
    return scene;
}

struct Scatter {
    double outwards_px = 0;  ///< mean error away from the ball's centre
    double rms_px = 0;       ///< per axis
    double normalised = 0;   ///< root mean square of error over sigma, per axis
};

Scatter scatter_of(const BallScene& scene) {
    const auto lights = dome_of_lights(16);
    const auto readings = find_highlights(photographs(scene, lights), scene.ball);
    Scatter scatter;
    for (std::size_t i = 0; i < lights.size(); ++i) {
        const Highlight seen = readings[i].highlight.value();
        const cv::Point2d truth = highlight_of(scene.ball, lights[i]).value();
        const cv::Point2d error = cv::Point2d(seen.u, seen.v) - truth;
        const cv::Point2d out = truth - cv::Point2d(scene.ball.x, scene.ball.y);
        scatter.outwards_px += error.dot(out) / cv::norm(out) / 16;
        scatter.rms_px += error.dot(error) / 32;
        scatter.normalised += error.dot(error) / (seen.sigma_px * seen.sigma_px) / 32;
    }
    scatter.rms_px = std::sqrt(scatter.rms_px);
    scatter.normalised = std::sqrt(scatter.normalised);
    fmt::print("radius {:3.0f}, lamp {:4.1f}, noise {:.3f}: outwards {:+.4f} px, rms {:.4f} px, over sigma {:.2f}\n",
               scene.ball.radius, scene.lamp_radiance, scene.noise, scatter.outwards_px, scatter.rms_px,
               scatter.normalised);
    return scatter;
}

// The lamp's mirror image is a disc of 0.03 radii; its centroid lies up to 0.0004 radii too far in.
TEST(FindHighlights, TheLampsMiddleIsRead) {
    for (const double radius : {40.0, 60.0, 120.0}) {
        const Scatter scatter = scatter_of(only_a_ball(radius, 0.8, 0));
        EXPECT_LT(std::abs(scatter.outwards_px), 0.01);
        EXPECT_LT(scatter.rms_px, 0.025);
    }
}

TEST(FindHighlights, SaturatedOnesAreReadByTheirBorder) {
    EXPECT_LT(scatter_of(only_a_ball(60, 5, 0.003)).rms_px, 0.06);
    EXPECT_LT(scatter_of(only_a_ball(90, 5, 0.003)).rms_px, 0.05);
}

TEST(FindHighlights, SigmaFollowsTheScatter) {
    for (const double radius : {20.0, 60.0})
        for (const double lamp : {0.8, 20.0})
            for (const double noise : {0.002, 0.02}) {
                const Scatter scatter = scatter_of(only_a_ball(radius, lamp, noise));
                EXPECT_GT(scatter.normalised, 0.4);
                EXPECT_LT(scatter.normalised, 1.8);
            }
}

TEST(FindHighlights, GrazingLampsAreInTheMirrorZone) {
    const BallScene scene = only_a_ball(40, 0.8, 0.003);
    std::vector<Eigen::Vector3d> lights;
    for (int i = 0; i < 6; ++i) lights.push_back(Eigen::Vector3d(std::cos(i), std::sin(i), 0.05).normalized());
    const auto readings = find_highlights(photographs(scene, lights), scene.ball);
    for (std::size_t i = 0; i < lights.size(); ++i) {
        ASSERT_TRUE(readings[i].highlight) << readings[i].reason;
        const cv::Point2d truth = highlight_of(scene.ball, lights[i]).value();
        EXPECT_LT(std::hypot(readings[i].highlight->u - truth.x, readings[i].highlight->v - truth.y), 0.15);
    }
}

TEST(FindHighlights, LeakingLampIsToldFromTheFramesOwn) {
    const BallScene scene = only_a_ball(50, 3, 0.003);
    const auto lights = dome_of_lights(8);
    auto frames = photographs(scene, lights);
    frames[2] = cv::Mat3f(cv::max(cv::Mat(frames[2]), cv::Mat(frames[5])));  // lamp 5 burns too, and saturates as well
    const auto readings = find_highlights(frames, scene.ball);
    for (std::size_t i = 0; i < lights.size(); ++i) {
        EXPECT_EQ(readings[i].other_spots, i == 2 ? 1 : 0);
        const cv::Point2d truth = highlight_of(scene.ball, lights[i]).value();
        EXPECT_LT(std::hypot(readings[i].highlight->u - truth.x, readings[i].highlight->v - truth.y), 0.3);
    }
}

TEST(FindHighlights, WhatStandsStillAndWhatIsLargeIsNoLamp) {
    const BallScene scene = only_a_ball(50, 0.9, 0.003);
    const auto lights = dome_of_lights(8);
    auto frames = photographs(scene, lights);
    for (std::size_t i = 0; i < frames.size(); ++i) frames[i](cv::Rect(40, 30, 8, 8)) = cv::Vec3f(1, 1, 1);  // a window
    frames[3] = photograph(only_a_ball(50, 0, 0.003), lights[3]);
    frames[3](cv::Rect(35, 55, 50, 25)) = cv::Vec3f(0.8F, 0.8F, 0.8F);  // the object, brightly lit
    const auto readings = find_highlights(frames, scene.ball);
    EXPECT_FALSE(readings[3].highlight);
    EXPECT_NE(readings[3].reason.find("too large"), std::string::npos);
    for (const std::size_t i : {0U, 1U, 2U, 4U, 5U}) {
        const cv::Point2d truth = highlight_of(scene.ball, lights[i]).value();
        EXPECT_LT(std::hypot(readings[i].highlight->u - truth.x, readings[i].highlight->v - truth.y), 0.1);
    }
}

}  // namespace
}  // namespace darkbox
