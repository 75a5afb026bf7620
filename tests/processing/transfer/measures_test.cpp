#include "processing/transfer/measures.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/processing/transfer/exemplars.h"

namespace darkbox {
namespace {

using test::plane_normals;
using test::stony_sphere;

cv::Mat2i shifted_copy(cv::Size size, cv::Vec2i shift) {
    cv::Mat2i coordinates(size);
    for (int y = 0; y < size.height; ++y)
        for (int x = 0; x < size.width; ++x) coordinates(y, x) = cv::Vec2i(x, y) + shift;
    return coordinates;
}

TEST(Coherence, IsOneForACopyAndFallsWithEachCut) {
    cv::Mat2i coordinates = shifted_copy({10, 10}, {3, 4});
    EXPECT_EQ(coherence(coordinates), 1.0);
    for (int y = 0; y < 10; ++y) coordinates(y, 9) += cv::Vec2i(5, 0);  // cuts 10 of the 180 pairs
    EXPECT_DOUBLE_EQ(coherence(coordinates), 170.0 / 180.0);
    coordinates.col(9).setTo(cv::Scalar(-1, -1));  // outside: no pair any more
    EXPECT_EQ(coherence(coordinates), 1.0);
}

TEST(Coverage, IsTheAngleThatIsMissing) {
    NormalMap target = plane_normals({8, 8});
    const NormalMap source = plane_normals({8, 8});
    EXPECT_NEAR(coverage_deg(source, target), 0, 1e-6);
    target.normal = cv::Vec3f(std::sin(0.5F), 0, std::cos(0.5F));
    EXPECT_NEAR(coverage_deg(source, target), 0.5 * 180 / CV_PI, 1e-3);
}

TEST(PatchEnergy, IsZeroForACopyAndKnowsItsUnit) {
    const AlbedoMap source = stony_sphere(48).albedo;
    EXPECT_EQ(patch_energy(source, source, 5, 1.0F), 0.0);
    AlbedoMap brighter{source.albedo.clone(), source.valid};
    AlbedoMap even{cv::Mat3f(48, 48, cv::Vec3f(0.2F, 0.2F, 0.2F)), source.valid};
    brighter.albedo = even.albedo + cv::Scalar(0.1, 0.1, 0.1);
    EXPECT_NEAR(patch_energy(even, brighter, 5, 1.0F), 25.5, 1e-3);
    EXPECT_NEAR(patch_energy(even, brighter, 5, 0.5F), 51.0, 1e-3);
}

TEST(HistogramDistance, IsZeroForAnyOrderAndTheShiftOtherwise) {
    AlbedoMap source = stony_sphere(48).albedo;
    AlbedoMap flipped{cv::Mat3f(48, 48), cv::Mat1b(48, 48)};
    cv::flip(source.albedo, flipped.albedo, 1);
    cv::flip(source.valid, flipped.valid, 1);
    EXPECT_EQ(histogram_distance(source, flipped, 1.0F), 0.0);
    flipped.albedo += cv::Scalar(0.2, 0.2, 0.2);
    EXPECT_NEAR(histogram_distance(source, flipped, 1.0F), 51, 1e-3);
}

TEST(WhiteLevel, IsNotMovedByOneBrightPixel) {
    AlbedoMap map{cv::Mat3f(30, 30, cv::Vec3f(0.1F, 0.4F, 0.2F)), cv::Mat1b(30, 30, std::uint8_t{255})};
    map.albedo(3, 3) = cv::Vec3f(50, 50, 50);
    EXPECT_FLOAT_EQ(white_level(map), 0.4F);
    map.albedo = cv::Vec3f(0, 0, 0);
    EXPECT_EQ(white_level(map), 1.0F);
}

}  // namespace
}  // namespace darkbox
