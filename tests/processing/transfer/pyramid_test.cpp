#include "processing/transfer/pyramid.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "tests/processing/transfer/exemplars.h"

namespace darkbox {
namespace {

using test::plane_normals;
using test::sphere_normals;

TEST(LowPass, LeavesAPlaneAsItIs) {
    NormalMap plane = plane_normals({20, 15});
    plane.valid.colRange(0, 5) = std::uint8_t{0};
    plane.normal.colRange(0, 5) = cv::Vec3f(1, 0, 0);  // what lies outside must not bleed in
    const NormalMap smooth = low_pass(plane, 3);
    for (int y = 0; y < 15; ++y)
        for (int x = 0; x < 20; ++x) {
            const cv::Vec3f expected = x < 5 ? cv::Vec3f(0, 0, 0) : cv::Vec3f(0, 0, 1);
            EXPECT_EQ(smooth.normal(y, x), expected) << x << ", " << y;
        }
}

TEST(LowPass, KeepsNormalsUnitAndASphereNearlyAsItIs) {
    const NormalMap sphere = sphere_normals(96);
    const NormalMap smooth = low_pass(sphere, 2);
    for (int y = 0; y < 96; ++y)
        for (int x = 0; x < 96; ++x) {
            if (!sphere.valid(y, x)) continue;
            EXPECT_NEAR(cv::norm(smooth.normal(y, x)), 1, 1e-5);
            const bool away_from_rim = sphere.normal(y, x)[2] > 0.5F;
            EXPECT_GT(smooth.normal(y, x).dot(sphere.normal(y, x)), away_from_rim ? 0.9995F : 0.9F);
        }
}

TEST(MapPyramid, EveryValidPixelHasAValidParent) {
    MapLevel finest{cv::Mat3f(37, 21, cv::Vec3f(0, 0, 1)), cv::Mat3f(37, 21, cv::Vec3f(0.5F, 0.25F, 1)),
                    cv::Mat1b(37, 21, std::uint8_t{0})};
    for (int i = 0; i < 21; ++i) finest.valid(i, 20 - i) = 255;
    const MapPyramid pyramid = map_pyramid(finest, 4);
    ASSERT_EQ(pyramid.size(), 4U);
    for (std::size_t level = 0; level + 1 < pyramid.size(); ++level)
        for (int y = 0; y < pyramid[level].valid.rows; ++y)
            for (int x = 0; x < pyramid[level].valid.cols; ++x)
                if (pyramid[level].valid(y, x)) {
                    EXPECT_TRUE(pyramid[level + 1].has({x / 2, y / 2}));
                    EXPECT_EQ(pyramid[level + 1].albedo(y / 2, x / 2), cv::Vec3f(0.5F, 0.25F, 1));
                }
}

TEST(MapPyramid, ThinMapsShrinkToOnePixelAndStayThere) {
    const MapLevel finest{cv::Mat3f(1, 9, cv::Vec3f(0, 0, 1)), cv::Mat3f(1, 9, cv::Vec3f(1, 1, 1)),
                          cv::Mat1b(1, 9, std::uint8_t{255})};
    const MapPyramid pyramid = map_pyramid(finest, 8);
    EXPECT_EQ(pyramid.back().valid.size(), cv::Size(1, 1));
    EXPECT_NE(pyramid.back().valid(0, 0), 0);
}

TEST(PyramidLevels, KeepTheShorterSideAt32OrMore) {
    EXPECT_EQ(pyramid_levels(0, {512, 512}, {512, 512}), 5);
    EXPECT_EQ(pyramid_levels(0, {512, 512}, {300, 64}), 2);
    EXPECT_EQ(pyramid_levels(0, {512, 512}, {1, 1}), 1);
    EXPECT_EQ(pyramid_levels(0, {127, 200}, {512, 512}), 2);
    EXPECT_EQ(pyramid_levels(3, {16, 16}, {16, 16}), 3);
}

}  // namespace
}  // namespace darkbox
