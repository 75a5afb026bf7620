#include "processing/transfer/transfer.h"

#include <gtest/gtest.h>

#include <cmath>

#include "processing/transfer/appearance.h"
#include "processing/transfer/measures.h"
#include "processing/transfer/pyramid.h"
#include "tests/processing/transfer/exemplars.h"

namespace darkbox {
namespace {

using test::by;
using test::equal;
using test::mean_guide_error_deg;
using test::plane_normals;
using test::sphere_normals;
using test::stony;
using test::stony_sphere;
using test::transferred_on;
using test::wavy_normals;

TEST(Transfer, OntoItselfGivesItself) {
    const TransferSource source = stony_sphere(64);
    TransferOptions options = by(TransferMethod::analogies);
    options.levels = 1;
    options.normal_sigma = 0;
    options.normal_weight = 100;
    // Every normal of a sphere is there once, so the feature of the pixel itself is the only one that is nearest.
    const TransferResult result = transfer_texture(source, source.normals, options);
    EXPECT_EQ(result.coherence, 1.0);
    EXPECT_EQ(result.patch_energy, 0.0);
    EXPECT_EQ(result.histogram_distance, 0.0);
    EXPECT_TRUE(equal(result.albedo.albedo, source.albedo.albedo));
    EXPECT_TRUE(equal(result.index.label, source.index.label));
}

TEST(Transfer, FollowsTheNormalsWithTheDefaults) {
    const TransferSource source = stony_sphere(96);
    const TransferResult result = transfer_texture(source, source.normals, by(TransferMethod::analogies));
    EXPECT_LT(mean_guide_error_deg(source.normals, source.normals, result.coordinates), 6);
    EXPECT_LT(result.coverage_deg, 0.01);
}

TEST(Transfer, NormalWeightBringsTheNormalsCloser) {
    const TransferSource source = stony_sphere(64);
    const NormalMap waves = wavy_normals({64, 64});
    TransferOptions options = by(TransferMethod::analogies);
    double before = 90;
    for (const double weight : {0.0, 1.0, 10.0}) {
        options.normal_weight = weight;
        const TransferResult result = transfer_texture(source, waves, options);
        const double now = mean_guide_error_deg(source.normals, waves, result.coordinates);
        EXPECT_LT(now, 0.8 * before) << weight;
        before = now;
    }
    EXPECT_LT(before, 6);
}

TEST(Transfer, UsesValidSourcePixelsOnly) {
    TransferSource source = stony_sphere(64);
    // Holes, and two masks that differ; bright where nothing may be read.
    for (int y = 0; y < 64; ++y)
        for (int x = 0; x < 64; ++x) {
            if ((x / 6 + y / 6) % 5 == 0) source.normals.valid(y, x) = 0;
            if ((x + y) % 11 == 0) source.albedo.valid(y, x) = 0;
            if (!source.normals.valid(y, x) || !source.albedo.valid(y, x)) source.albedo.albedo(y, x) = {9, 9, 9};
        }
    NormalMap target = wavy_normals({70, 50});
    target.valid.colRange(10, 14) = std::uint8_t{0};
    const TransferResult result = transfer_texture(source, target, by(TransferMethod::analogies));
    for (int y = 0; y < 50; ++y)
        for (int x = 0; x < 70; ++x) {
            const cv::Vec2i at = result.coordinates(y, x);
            if (!target.valid(y, x)) {
                EXPECT_EQ(at, cv::Vec2i(-1, -1));
                EXPECT_EQ(result.albedo.albedo(y, x), cv::Vec3f(0, 0, 0));
                EXPECT_EQ(result.index.label(y, x), 0);
                continue;
            }
            ASSERT_TRUE(source.normals.valid(at[1], at[0]) && source.albedo.valid(at[1], at[0])) << at;
            EXPECT_EQ(result.albedo.albedo(y, x), source.albedo.albedo(at[1], at[0]));
            EXPECT_EQ(result.index.label(y, x), source.index.label(at[1], at[0]));
        }
    EXPECT_TRUE(equal(result.albedo.valid, target.valid));
    EXPECT_EQ(result.index.texels, source.index.texels);
}

TEST(Transfer, IsTheSameOnAnyNumberOfThreads) {
    const TransferSource source = stony_sphere(64);
    const NormalMap target = wavy_normals({75, 66});
    const TransferResult one = transferred_on(1, source, target, by(TransferMethod::analogies));
    for (const int threads : {2, 8}) {
        const TransferResult many = transferred_on(threads, source, target, by(TransferMethod::analogies));
        EXPECT_TRUE(equal(one.coordinates, many.coordinates)) << threads;
        EXPECT_EQ(one.patch_energy, many.patch_energy);
        EXPECT_EQ(one.coverage_deg, many.coverage_deg);
    }
}

TEST(Transfer, KappaBringsCoherence) {
    const TransferSource source = stony_sphere(64);
    const NormalMap target = wavy_normals({64, 64});
    TransferOptions options = by(TransferMethod::analogies);
    options.passes = 0;
    double before = 0;
    for (const double kappa : {0.0, 2.0, 25.0}) {
        options.kappa = kappa;
        const double now = transfer_texture(source, target, options).coherence;
        EXPECT_GT(now, before + 0.05) << kappa;
        before = now;
    }
}

TEST(Transfer, MeasuresItselfAsAnybodysResultIsMeasured) {
    TransferSource source = stony_sphere(96);
    for (const std::optional<float> white : {std::optional<float>(), std::optional<float>(1.0F)}) {
        source.white = white;
        const NormalMap target = wavy_normals({96, 80});
        const TransferResult result = transfer_texture(source, target, by(TransferMethod::patchmatch));
        const Appearance shown =
            appearance_of(source.normals, source.albedo, white.value_or(white_level(source.albedo)));
        const TransferMeasures measures = measure_coordinates(shown, target, result.coordinates, {.stride = 16});
        EXPECT_EQ(result.patch_energy, measures.patch_energy);
        EXPECT_EQ(result.histogram_distance, measures.histogram_distance);
        EXPECT_EQ(result.coherence, measures.coherence);
    }
}

TEST(Transfer, DoesNotDependOnExposure) {
    TransferSource source = stony_sphere(48);
    const NormalMap target = wavy_normals({40, 40});
    const TransferResult bright = transfer_texture(source, target, by(TransferMethod::analogies));
    source.albedo.albedo *= 0.25;
    const TransferResult dark = transfer_texture(source, target, by(TransferMethod::analogies));
    EXPECT_TRUE(equal(bright.coordinates, dark.coordinates));
    EXPECT_NEAR(bright.patch_energy.value(), dark.patch_energy.value(), 1e-4);
}

TEST(Transfer, OneColourGivesThatColour) {
    TransferSource source = stony_sphere(48);
    source.albedo.albedo.setTo(cv::Scalar(0.3, 0.2, 0.1), source.albedo.valid);
    source.index = {};
    const TransferResult result = transfer_texture(source, wavy_normals({40, 30}), by(TransferMethod::analogies));
    for (const cv::Vec3f& v : result.albedo.albedo) EXPECT_EQ(v, cv::Vec3f(0.3F, 0.2F, 0.1F));
    EXPECT_TRUE(result.index.label.empty());
    EXPECT_EQ(result.index.texels, 0);
}

TEST(Transfer, StripesStayStripes) {
    constexpr int period = 8;
    TransferSource source{plane_normals({64, 64}), {cv::Mat3f(64, 64), cv::Mat1b(64, 64, std::uint8_t{255})}, {}};
    for (int y = 0; y < 64; ++y)
        for (int x = 0; x < 64; ++x)
            source.albedo.albedo(y, x) =
                x % period < period / 2 ? cv::Vec3f(0.8F, 0.7F, 0.6F) : cv::Vec3f(0.1F, 0.1F, 0.2F);
    TransferOptions options = by(TransferMethod::analogies);
    options.window = 9;  // must see a whole stripe to the left to know where it ends
    const TransferResult result = transfer_texture(source, plane_normals({72, 60}), options);
    int unlike_above = 0;
    int unlike_a_period_before = 0;
    for (int y = 1; y < 60; ++y)
        for (int x = period; x < 72; ++x) {
            const cv::Vec3f& here = result.albedo.albedo(y, x);
            if (here != result.albedo.albedo(y - 1, x)) ++unlike_above;
            if (here != result.albedo.albedo(y, x - period)) ++unlike_a_period_before;
        }
    EXPECT_LT(unlike_above, 0.02 * 59 * 64);
    EXPECT_LT(unlike_a_period_before, 0.05 * 59 * 64);
    EXPECT_LT(result.patch_energy.value(), 1);
}

TEST(Transfer, WorksWithOneSourcePixel) {
    TransferSource source = stony_sphere(16);
    source.normals.valid = std::uint8_t{0};
    source.normals.valid(8, 7) = 255;
    const TransferResult result = transfer_texture(source, wavy_normals({20, 12}), by(TransferMethod::analogies));
    for (const cv::Vec2i& at : result.coordinates) EXPECT_EQ(at, cv::Vec2i(7, 8));
    EXPECT_GT(result.coverage_deg, 10);
    EXPECT_FALSE(result.patch_energy);  // no whole patch to compare with
}

TEST(Transfer, WorksForTargetsOfAnyShape) {
    const TransferSource source = stony_sphere(48);
    TransferOptions options = by(TransferMethod::analogies);
    options.levels = 4;
    options.window = 15;
    options.coarse_window = 5;
    for (const cv::Size size : {cv::Size(1, 1), cv::Size(300, 1), cv::Size(1, 300), cv::Size(17, 3)}) {
        const TransferResult result = transfer_texture(source, plane_normals(size), options);
        EXPECT_EQ(result.coordinates.size(), size);
        for (const cv::Vec2i& at : result.coordinates) EXPECT_GE(at[0], 0);
    }
}

TEST(Transfer, TellsItsProgress) {
    std::vector<ProgressUpdate> updates;
    WorkContext work;
    work.report = [&](const ProgressUpdate& update) { updates.push_back(update); };
    transfer_texture(stony_sphere(64), wavy_normals({64, 64}), by(TransferMethod::analogies), work);
    ASSERT_FALSE(updates.empty());
    EXPECT_EQ(updates.back().stage, "transfer");
    EXPECT_EQ(updates.back().done, 64U + 32U);
    EXPECT_EQ(updates.back().total, 64U + 32U);
    for (std::size_t i = 1; i < updates.size(); ++i) EXPECT_GT(updates[i].done, updates[i - 1].done);
}

}  // namespace
}  // namespace darkbox
