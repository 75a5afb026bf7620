#include "rig/cli/arguments.h"

#include <gtest/gtest.h>

#include "acquisition/frame/error.h"

namespace darkbox {
namespace {

TEST(ParseNumbers, TakesExactlyTheCountAsked) {
    EXPECT_EQ(parse_numbers("--x", "1,-2.5,3e2", 3), (std::vector<double>{1, -2.5, 300}));
    for (const char* bad :
         {"", "1", "1,2", "1,2,3,4", "1,2,", ",1,2", "1 ,2,3", "1,2,x", "1,2,nan", "1,2,inf", "1;2;3"})
        EXPECT_THROW(parse_numbers("--x", bad, 3), InputError) << bad;
}

TEST(ParseLight, IsUnitLengthAndKeepsItsIntensity) {
    const Light light = parse_light("0,3,4:1,0.5,0");
    EXPECT_NEAR((light.direction - Eigen::Vector3d(0, 0.6, 0.8)).norm(), 0, 1e-15);
    EXPECT_EQ(light.intensity, Eigen::Vector3d(1, 0.5, 0));
    EXPECT_THROW(parse_light("0,0,0"), InputError);
    EXPECT_THROW(parse_light("0,0,1:1,1,-1"), InputError);
}

TEST(ParseHighlight, SplitsAtTheLastEqualsSign) {
    const auto [frame, at] = parse_highlight("odd=name.png=12.5,7");
    EXPECT_EQ(frame, "odd=name.png");
    EXPECT_EQ(at, cv::Point2d(12.5, 7));
    EXPECT_THROW(parse_highlight("12,7"), InputError);
    EXPECT_THROW(parse_highlight("=12,7"), InputError);
}

TEST(ParseBall, IsTrustedFully) {
    const Ball ball = parse_ball("100.5,80,42");
    EXPECT_EQ(ball.radius, 42);
    EXPECT_EQ(ball.confidence, 1.0);
}

TEST(InOptions, FieldsAreCalledByTheOptionsThatWereGiven) {
    EXPECT_EQ(in_options("memory_mib is 0", {"solver", "memory-mib"}), "--memory-mib is 0");
    EXPECT_EQ(in_options("normal_sigma is -1", {"sigma"}), "--sigma is -1");
    EXPECT_EQ(in_options("shading: levels is 1, allowed are 2...256", {"levels"}),
              "--levels is 1, allowed are 2...256");
    EXPECT_EQ(in_options("ball_diameter_mm is 0", {"ball-diameter"}), "--ball-diameter is 0");
    EXPECT_EQ(in_options("memory_mib is 0", {"solver"}), "memory_mib is 0");
    EXPECT_EQ(in_options("s/results/normals.exr is not there yet", {"out"}), "s/results/normals.exr is not there yet");
    EXPECT_EQ(in_options(" is ", {"out"}), " is ");
}

}  // namespace
}  // namespace darkbox
