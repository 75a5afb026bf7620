#include "processing/transfer/measures.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "acquisition/frame/error.h"
#include "processing/transfer/patch_energy.h"
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

Appearance stones(int side) {
    const TransferSource source = stony_sphere(side);
    return appearance_of(source.normals, source.albedo, 1.0F);
}

Appearance even(cv::Vec3b colour) { return {plane_normals({32, 32}), cv::Mat3b(32, 32, colour)}; }

/// All there is to the definition, without a tree.
double energy_by_brute_force(const Appearance& source, const Appearance& target, int window, int stride) {
    const int radius = window / 2;
    const cv::Mat1b from = inner_pixels(source.normals.valid, radius);
    const cv::Mat1b to = inner_pixels(target.normals.valid, radius);
    double sum = 0;
    int count = 0;
    for (int y = stride / 4; y < to.rows; y += stride)
        for (int x = stride / 4; x < to.cols; x += stride) {
            if (!to(y, x)) continue;
            const cv::Mat patch = target.picture(cv::Rect(x - radius, y - radius, window, window));
            double nearest = std::numeric_limits<double>::infinity();
            for (int v = 0; v < from.rows; ++v)
                for (int u = 0; u < from.cols; ++u)
                    if (from(v, u))
                        nearest = std::min(
                            nearest, cv::norm(patch, source.picture(cv::Rect(u - radius, v - radius, window, window))));
            sum += nearest / std::sqrt(3.0 * window * window);
            ++count;
        }
    return sum / count;
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

TEST(WhiteLevel, IsNotMovedByOneBrightPixel) {
    AlbedoMap map{cv::Mat3f(30, 30, cv::Vec3f(0.1F, 0.4F, 0.2F)), cv::Mat1b(30, 30, std::uint8_t{255})};
    map.albedo(3, 3) = cv::Vec3f(50, 50, 50);
    EXPECT_FLOAT_EQ(white_level(map), 0.4F);
    map.albedo = cv::Vec3f(0, 0, 0);
    EXPECT_EQ(white_level(map), 1.0F);
}

TEST(PatchEnergy, FindsTheNearestOfAll) {
    const Appearance source = stones(48);
    Appearance target = stones(40);
    cv::RNG(5).fill(target.picture, cv::RNG::UNIFORM, 60, 200);
    for (const int window : {3, 5})
        EXPECT_NEAR(*patch_energy(colour_patches(source, window), colour_patches(target, window), window, 4),
                    energy_by_brute_force(source, target, window, 4), 1e-9);
}

TEST(PatchEnergy, CountsNormalsLikeColours) {
    const Appearance source = even({50, 100, 150});
    Appearance target = even({60, 110, 160});
    EXPECT_NEAR(*patch_energy(joint_patches(source, 5), joint_patches(target, 5), 5, 4), 10, 1e-9);
    target.normals.normal = cv::Vec3f(0.6F, 0, 0.8F);  // encoded as (204, 127.5, 229.5) instead of (127.5, 127.5, 255)
    const double normals = (76.0 * 76.0 + 25.0 * 25.0) / 3;
    EXPECT_NEAR(*patch_energy(joint_patches(source, 5), joint_patches(target, 5), 5, 4), std::sqrt(100 + normals), 0.5);
}

TEST(PatchEnergy, IsNothingWithoutAWholePatch) {
    Appearance target = even({0, 0, 0});
    target.normals.valid.row(2).setTo(0);
    target.normals.valid.rowRange(3, 32).setTo(0);
    const Appearance source = even({0, 0, 0});
    EXPECT_FALSE(patch_energy(colour_patches(source, 5), colour_patches(target, 5), 5, 1));
}

TEST(Measures, AreThoseOfTheSourceForACopy) {
    const Appearance source = stones(96);
    const TransferMeasures m = measure_coordinates(source, source.normals, shifted_copy(source.picture.size(), {0, 0}));
    EXPECT_EQ(*m.joint_energy, 0);
    EXPECT_EQ(*m.patch_energy, 0);
    EXPECT_EQ(*m.seam, 0);
    EXPECT_LT(*m.angle_mean_deg, 0.02);
    EXPECT_EQ(*m.coherence, 1);
    EXPECT_EQ(*m.cover, 1);
    EXPECT_EQ(*m.background, 0);
    EXPECT_NEAR(*m.sharpness, 1, 0.02);
    EXPECT_NEAR(*m.histogram_distance, 0, 0.3);
}

TEST(Measures, TellAColourThatIsOffEverywhere) {
    const Appearance source = even({50, 100, 150});
    const TransferMeasures m = measure_picture(source, even({60, 110, 160}));
    EXPECT_NEAR(*m.colour_error, 10, 1e-3);
    EXPECT_GT(*m.histogram_distance, 3);
    EXPECT_FALSE(m.sharpness) << "an even source has no sharpness to compare with";
    EXPECT_FALSE(m.seam) << "a picture has no coordinates";
    EXPECT_FALSE(m.angle_mean_deg);
    EXPECT_FALSE(m.cover);
}

TEST(Measures, ExpectTheColourThatBelongsToTheNormal) {
    Appearance source = stones(96);
    for (int y = 0; y < 96; ++y)
        source.picture.row(y).setTo(y < 48 ? cv::Scalar(40, 200, 40) : cv::Scalar(120, 90, 60));
    Appearance target = even({40, 200, 40});
    target.normals.normal = cv::Vec3f(0, 0.6F, 0.8F);  // faces up, where the source is green
    EXPECT_NEAR(*measure_picture(source, target).colour_error, 0, 0.1);
    EXPECT_NEAR(*measure_picture(source, target).histogram_distance, 0, 0.1);
    target.normals.normal = cv::Vec3f(0, -0.6F, 0.8F);
    EXPECT_NEAR(*measure_picture(source, target).colour_error, std::sqrt((80.0 * 80 + 110.0 * 110 + 20.0 * 20) / 3),
                0.5);
}

TEST(Measures, CountCutsCoverAndBackground) {
    Appearance source = even({10, 10, 10});
    source.picture.colRange(16, 32).setTo(cv::Scalar(50, 50, 50));
    cv::Mat2i coordinates = shifted_copy({32, 32}, {0, 0});
    coordinates.colRange(16, 32).setTo(cv::Scalar(0, 0));  // every pixel of the right half shows the same dark one
    const TransferMeasures m = measure_coordinates(source, source.normals, coordinates);
    EXPECT_DOUBLE_EQ(*m.cover, 0.5);
    EXPECT_EQ(*m.background, 0);
    // Only across the cut: the source goes on with 50 on one side; what lies before (0, 0) is cut off at the border.
    EXPECT_NEAR(*m.seam, 32 * std::sqrt(40.0 * 40.0 / 2) / (2 * 31 * 32), 1e-9);
    source.normals.valid(0, 0) = 0;
    EXPECT_EQ(*measure_coordinates(source, plane_normals({32, 32}), coordinates).background, 16 * 32 + 1);
}

TEST(Measures, AreTheSameOnAnyNumberOfThreads) {
    const Appearance source = stones(64);
    const Appearance target = stones(48);
    WorkContext one;
    one.threads = 1;
    WorkContext eight;
    eight.threads = 8;
    EXPECT_EQ(measure_picture(source, target, {}, one).joint_energy,
              measure_picture(source, target, {}, eight).joint_energy);
}

TEST(Measures, RefuseWhatDoesNotBelongTogether) {
    const Appearance source = even({10, 10, 10});
    EXPECT_THROW(measure_coordinates(source, source.normals, shifted_copy({31, 32}, {0, 0})), InputError);
    EXPECT_THROW(measure_coordinates(source, source.normals, shifted_copy({32, 32}, {1, 0})), InputError);
    Appearance wrong = source;
    wrong.picture = cv::Mat3b(8, 8, cv::Vec3b(0, 0, 0));
    EXPECT_THROW(measure_picture(source, wrong), InputError);
    MeasureOptions options;
    options.window = 4;
    EXPECT_THROW(measure_picture(source, source, options), InputError);
}

}  // namespace
}  // namespace darkbox
