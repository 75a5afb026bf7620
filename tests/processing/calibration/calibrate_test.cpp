#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <opencv2/imgproc.hpp>

#include "acquisition/frame/error.h"
#include "processing/calibration/calibration.h"
#include "tests/processing/calibration/ball_scene.h"

namespace darkbox {
namespace {

using test::BallScene;
using test::dome_of_lights;
using test::frame_names;
using test::photographs;

std::vector<double> errors_deg(const Calibration& calibration, const std::vector<Eigen::Vector3d>& truth) {
    std::vector<double> errors;
    for (std::size_t i = 0; i < truth.size(); ++i)
        if (calibration.lights[i].used) errors.push_back(angle_deg(calibration.lights[i].direction, truth[i]));
    std::sort(errors.begin(), errors.end());
    return errors;
}

bool mentions(const std::vector<std::string>& sentences, const std::string& word) {
    return std::any_of(sentences.begin(), sentences.end(),
                       [&](const std::string& s) { return s.find(word) != std::string::npos; });
}

std::string message_of(const std::vector<cv::Mat3f>& frames, const CalibrationOptions& options) {
    try {
        calibrate(frames, frame_names(frames.size()), options);
    } catch (const InputError& error) {
        return std::string(error.what()) + " / " + error.hint();
    }
    return {};
}

TEST(Calibrate, FindsBallAndLightsWithoutHelp) {
    const BallScene scene;
    const auto lights = dome_of_lights(12);
    const auto calibration = calibrate(photographs(scene, lights), frame_names(12));
    ASSERT_EQ(calibration.balls.size(), 1U);
    EXPECT_NEAR(calibration.balls[0].x, scene.ball.x, 0.1);
    EXPECT_NEAR(calibration.balls[0].y, scene.ball.y, 0.1);
    EXPECT_NEAR(calibration.balls[0].radius, scene.ball.radius, 0.15);
    const auto errors = errors_deg(calibration, lights);
    ASSERT_EQ(errors.size(), 12U);
    fmt::print("ball {:.3f} {:.3f} {:.3f}; median {:.3f}, worst {:.3f} degrees\n", calibration.balls[0].x,
               calibration.balls[0].y, calibration.balls[0].radius, errors[6], errors.back());
    EXPECT_LT(errors.back(), 0.25);
    EXPECT_TRUE(calibration.warnings.empty()) << calibration.warnings.front();
    EXPECT_EQ(calibration.lights[3].file, "frame3.tif");
}

TEST(Calibrate, ClippedHighlightsAreReadNearlyAsWell) {
    BallScene scene;
    scene.lamp_radius_deg = 4.0;
    scene.lamp_radiance = 4.0;
    const auto lights = dome_of_lights(12);
    const auto calibration = calibrate(photographs(scene, lights), frame_names(12));
    EXPECT_TRUE(calibration.highlights[0]->clipped);
    const auto errors = errors_deg(calibration, lights);
    fmt::print("clipped: median {:.3f}, worst {:.3f} degrees\n", errors[6], errors.back());
    EXPECT_LT(errors.back(), 0.4);
}

TEST(Calibrate, RefinedBeatsBrightestUnderNoise) {
    BallScene scene;
    scene.noise = 0.01;
    const auto lights = dome_of_lights(12);
    const auto frames = photographs(scene, lights);
    CalibrationOptions thesis;
    thesis.method = CalibrationMethod::brightest;
    const double refined = errors_deg(calibrate(frames, frame_names(12)), lights)[6];
    const double brightest = errors_deg(calibrate(frames, frame_names(12), thesis), lights)[6];
    fmt::print("noisy: median {:.3f} degrees refined, {:.3f} brightest\n", refined, brightest);
    EXPECT_LT(refined, 0.15);
    EXPECT_LT(refined, brightest);
}

TEST(Calibrate, SameBitsEveryTime) {
    const auto lights = dome_of_lights(6);
    const auto frames = photographs({}, lights);
    const auto a = calibrate(frames, frame_names(6)), b = calibrate(frames, frame_names(6));
    for (std::size_t i = 0; i < 6; ++i) EXPECT_EQ(a.lights[i].direction, b.lights[i].direction);
}

TEST(Calibrate, FrameWithoutHighlightIsLeftOutAndNamed) {
    const auto lights = dome_of_lights(8);
    auto frames = photographs({}, lights);
    BallScene dark;
    dark.lamp_radiance = 0;
    frames[5] = photograph(dark, lights[5]);
    const auto calibration = calibrate(frames, frame_names(8));
    EXPECT_FALSE(calibration.lights[5].used);
    EXPECT_FALSE(calibration.highlights[5]);
    EXPECT_TRUE(mentions(calibration.warnings, "frame5.tif"));
    EXPECT_EQ(errors_deg(calibration, lights).size(), 7U);
}

TEST(Calibrate, GivenBallIsTaken) {
    const BallScene scene;
    const auto lights = dome_of_lights(8);
    CalibrationOptions options;
    options.balls = {Ball{std::round(scene.ball.x), std::round(scene.ball.y), std::round(scene.ball.radius), 1.0}};
    EXPECT_LT(errors_deg(calibrate(photographs(scene, lights), frame_names(8), options), lights).back(), 0.25);
}

TEST(Calibrate, MaskSaysWhereTheBallIs) {
    const BallScene scene;
    const auto lights = dome_of_lights(8);
    cv::Mat1b mask(scene.size, uchar{0});
    cv::circle(mask, cv::Point(cvRound(16 * scene.ball.x), cvRound(16 * scene.ball.y)), cvRound(16 * scene.ball.radius),
               255, cv::FILLED, cv::LINE_AA, 4);
    CalibrationOptions options;
    options.ball_mask = mask;
    const auto calibration = calibrate(photographs(scene, lights), frame_names(8), options);
    EXPECT_NEAR(calibration.balls[0].x, scene.ball.x, 0.2);
    EXPECT_NEAR(calibration.balls[0].radius, scene.ball.radius, 0.7);
    EXPECT_LT(errors_deg(calibration, lights).back(), 1.0);
}

TEST(Calibrate, HighlightsByHandAndDroppedFrames) {
    const auto lights = dome_of_lights(6);
    CalibrationOptions options;
    options.highlights = {{"frame2.tif", {250.3, 130.6}}};
    options.drop = {"frame4.tif"};
    const auto calibration = calibrate(photographs({}, lights), frame_names(6), options);
    EXPECT_LT(angle_deg(calibration.lights[2].direction, {0, 0, 1}), 0.5);
    EXPECT_FALSE(calibration.lights[4].used);
    EXPECT_TRUE(mentions(calibration.rejected, "frame4.tif"));
}

TEST(Calibrate, DuplicateAndCoplanarLightsAreWarnedOf) {
    std::vector<Eigen::Vector3d> lights;
    for (const double x : {-0.5, -0.2, 0.2, 0.2, 0.5}) lights.push_back(Eigen::Vector3d(x, 0.001, 0.8).normalized());
    const auto calibration = calibrate(photographs({}, lights), frame_names(5));
    EXPECT_TRUE(mentions(calibration.warnings, "frame2.tif and frame3.tif"));
    EXPECT_TRUE(mentions(calibration.warnings, "one plane"));
}

TEST(Calibrate, NoBallIsAnErrorWithARemedy) {
    BallScene scene;
    scene.ball = {-500, -500, 20, 1.0};
    EXPECT_NE(message_of(photographs(scene, dome_of_lights(6)), {}).find("--ball"), std::string::npos);
}

TEST(Calibrate, BallOutsideThePictureIsAnError) {
    CalibrationOptions options;
    options.balls = {Ball{900, 20, 30, 1.0}};
    EXPECT_NE(message_of(photographs({}, dome_of_lights(4)), options).find("outside"), std::string::npos);
}

TEST(Calibrate, NoHighlightAtAllIsAnError) {
    BallScene scene;
    scene.lamp_radiance = 0;
    CalibrationOptions options;
    options.balls = {scene.ball};
    EXPECT_NE(message_of(photographs(scene, dome_of_lights(4)), options).find("highlight"), std::string::npos);
}

TEST(Calibrate, UnknownFrameIsNamedWithTheKnownOnes) {
    CalibrationOptions options;
    options.drop = {"nobody.tif"};
    const std::string message = message_of(photographs({}, dome_of_lights(4)), options);
    EXPECT_NE(message.find("nobody.tif"), std::string::npos);
    EXPECT_NE(message.find("frame3.tif"), std::string::npos);
}

TEST(Calibrate, FramesOfAnotherSizeAreNamed) {
    auto frames = photographs({}, dome_of_lights(4));
    frames[1] = cv::Mat3f(5, 5);
    EXPECT_NE(message_of(frames, {}).find("frame1.tif"), std::string::npos);
}

TEST(Calibrate, TheSameBallTwiceIsAnError) {
    const BallScene scene;
    CalibrationOptions options;
    options.balls = {scene.ball, scene.ball};
    EXPECT_NE(message_of(photographs(scene, dome_of_lights(4)), options).find("overlap"), std::string::npos);
}

TEST(Calibrate, AHighlightOutsideTheBallIsAnError) {
    const BallScene scene;
    CalibrationOptions options;
    options.highlights = {{"frame1.tif", {20, 20}}};
    EXPECT_NE(message_of(photographs(scene, dome_of_lights(4)), options).find("outside the ball"), std::string::npos);
}

TEST(Calibrate, NearLampsNeedAScaleAndASecondBallOrTheRig) {
    const auto frames = photographs({}, dome_of_lights(4));
    CalibrationOptions options;
    options.lamps = LampModel::near;
    EXPECT_NE(message_of(frames, options).find("scale"), std::string::npos);
    options.ball_diameter_mm = 36;
    EXPECT_NE(message_of(frames, options).find("one ball"), std::string::npos);
}

TEST(Calibrate, ADiameterTellsTheScaleAndALampsModelFollowsFromTheRig) {
    const auto lights = dome_of_lights(4);
    const auto frames = photographs({}, lights);
    CalibrationOptions options;
    options.ball_diameter_mm = 36;
    options.nominal.emplace();
    for (const auto& light : lights) options.nominal->position_in_rig_mm.emplace_back(light * 700);
    const auto near = calibrate(frames, frame_names(4), options);
    EXPECT_NEAR(near.view->mm_per_pixel, 18 / 60.2, 0.002);
    EXPECT_TRUE(near.lights[0].near);
    for (auto& place : options.nominal->position_in_rig_mm) *place *= 10;
    EXPECT_FALSE(calibrate(frames, frame_names(4), options).lights[0].near);
    options.ball_diameter_mm.reset();
    EXPECT_FALSE(calibrate(frames, frame_names(4), options).view);
}

TEST(CalibrationOptions, WhatIsNoLengthIsNamed) {
    for (const double bad : {0.0, -1.0, std::nan(""), std::numeric_limits<double>::infinity()}) {
        CalibrationOptions options;
        options.ball_diameter_mm = bad;
        EXPECT_THROW(options.validate(), InputError);
        options = {};
        options.view = ViewGeometry{bad, {0, 0}};
        EXPECT_THROW(options.validate(), InputError);
        options = {};
        options.nominal.emplace();
        options.nominal->slack_mm = bad;
        EXPECT_THROW(options.validate(), InputError);
    }
}

TEST(CalibrationOptions, RadiusMustBePositive) {
    CalibrationOptions options;
    options.balls = {Ball{10, 10, -4, 1.0}};
    EXPECT_THROW(options.validate(), InputError);
}

}  // namespace
}  // namespace darkbox
