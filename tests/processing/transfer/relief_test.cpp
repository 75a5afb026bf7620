#include "processing/transfer/relief.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/processing/transfer/exemplars.h"

namespace darkbox {
namespace {

cv::Vec3f unit(const cv::Vec3f& v) { return v * static_cast<float>(1 / cv::norm(v)); }

TEST(Turned, TakesFromToToAndKeepsAnglesAndTheAxis) {
    const cv::Vec3f from = unit({0.2F, -0.5F, 0.8F});
    const cv::Vec3f to = unit({-0.7F, 0.1F, 0.3F});
    const cv::Vec3f v = unit({0.4F, 0.4F, 0.9F});
    EXPECT_LT(cv::norm(turned(from, from, to) - to), 1e-6);
    EXPECT_NEAR(turned(v, from, to).dot(to), v.dot(from), 1e-6);
    EXPECT_NEAR(cv::norm(turned(v, from, to)), 1, 1e-6);
    const cv::Vec3f axis = unit(from.cross(to));
    EXPECT_LT(cv::norm(turned(axis, from, to) - axis), 1e-6);
    EXPECT_LT(cv::norm(turned(from, from, -from) + from), 1e-6);
    EXPECT_LT(cv::norm(turned(v, from, from) - v), 1e-6);
}

/// Ripples on a plane, moved onto a slope: the slope comes out with the same ripples about its own normal.
TEST(MovedRelief, RipplesKeepTheirAnglesOnASlope) {
    const cv::Size size(48, 48);
    NormalMap source = test::plane_normals(size);
    for (int y = 0; y < 48; ++y)
        for (int x = 0; x < 48; ++x) source.normal(y, x) = unit({0.2F * std::sin(static_cast<float>(x) * 2.1F), 0, 1});
    const MapLevel smooth{test::plane_normals(size).normal, {}, source.valid};
    NormalMap slope = test::plane_normals(size);
    slope.normal = unit({0.3F, 0.4F, 0.9F});
    cv::Mat2i coordinates(size);
    for (int y = 0; y < 48; ++y)
        for (int x = 0; x < 48; ++x) coordinates(y, x) = {47 - x, y};
    const NormalMap moved = moved_relief(source, smooth, coordinates, slope);
    for (int y = 0; y < 48; ++y)
        for (int x = 0; x < 48; ++x)
            EXPECT_NEAR(moved.normal(y, x).dot(slope.normal(y, x)), source.normal(y, 47 - x)[2], 1e-5);
}

TEST(MovedRelief, WithoutReliefTheTargetStaysAsItIs) {
    TransferSource source = test::stony(test::plane_normals({40, 40}), 30, 3);
    const NormalMap waves = test::wavy_normals({40, 40});
    const TransferResult result = transfer_texture(source, waves, test::by(TransferMethod::preview));
    for (int y = 0; y < 40; ++y)
        for (int x = 0; x < 40; ++x) EXPECT_LT(cv::norm(result.normals.normal(y, x) - waves.normal(y, x)), 1e-5);
}

}  // namespace
}  // namespace darkbox
