#include "processing/normals/semi_calibrated.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <random>

#include "processing/calibration/intensity.h"
#include "tests/processing/normals/lit_sphere.h"
#include "tests/support/textured_sphere.h"
#include "tests/support/throws.h"

namespace darkbox {
namespace {

using testing::HasSubstr;

/// Lights that do not lie on one cone around the view axis, of very unequal intensities.
Lights uneven_lights(int count) {
    Lights lights = test::ring_of_lights(count);
    for (int i = 0; i < count; ++i) {
        Light& light = lights[static_cast<std::size_t>(i)];
        if (i % 3 == 0) light.direction = (light.direction + Eigen::Vector3d(0, 0, 0.8)).normalized();
        light.intensity = {0.6 + 0.8 * ((i * 5) % 7) / 7.0, 0.7 + 0.6 * ((i * 3) % 5) / 5.0, 1.0};
    }
    return with_mean_intensity_one(lights);
}

test::TexturedSphere lit_by(const Lights& lights, int side = 96) {
    test::TexturedSphere scene = test::textured_sphere(side, static_cast<int>(lights.size()));
    scene.lights = lights;
    for (std::size_t i = 0; i < lights.size(); ++i)
        scene.stack.images[i] = test::lambert_photograph(scene.normals, scene.albedo, lights[i]);
    return scene;
}

Lights without_intensities(Lights lights) {
    for (Light& light : lights) light.intensity.setOnes();
    return lights;
}

/// Largest relative error of any lamp in any channel.
double worst_error(const Lights& found, const Lights& truth) {
    double worst = 0;
    for (std::size_t i = 0; i < found.size(); ++i)
        worst = std::max(worst, (found[i].intensity.cwiseQuotient(truth[i].intensity).array() - 1).abs().maxCoeff());
    return worst;
}

TEST(SemiCalibrated, ExactLambertGivesExactIntensities) {
    const Lights lights = uneven_lights(12);
    const test::TexturedSphere scene = lit_by(lights);
    const SemiCalibratedResult result = estimate_intensities(scene.stack, without_intensities(lights));
    EXPECT_TRUE(result.converged);
    EXPECT_LE(worst_error(result.lights, lights), 0.005);
    EXPECT_LE(result.residual, 0.01 * result.residual_equal);
}

TEST(SemiCalibrated, FourLightsAreEnoughWhereAllAreSeen) {
    Lights lights = uneven_lights(5);
    lights.pop_back();
    lights = with_mean_intensity_one(lights);
    const test::TexturedSphere scene = lit_by(lights);
    EXPECT_LE(worst_error(estimate_intensities(scene.stack, without_intensities(lights)).lights, lights), 0.005);
}

TEST(SemiCalibrated, GlossAndNoiseCostAFewPercentAtMost) {
    const Lights lights = uneven_lights(16);
    test::TexturedSphere scene = lit_by(lights);
    std::mt19937 random(11);
    std::normal_distribution<float> noise(0, 0.01F);
    for (std::size_t i = 0; i < lights.size(); ++i)
        for (int y = 0; y < 96; ++y)
            for (int x = 0; x < 96; ++x) {
                if (!scene.stack.mask(y, x)) continue;
                const cv::Vec3f& n = scene.normals.normal(y, x);
                const double nl = test::n_dot_l(n, lights[i]);
                const double mirrored = 2 * nl * n[2] - lights[i].direction.z();
                const double gloss = nl > 0 ? 0.5 * std::pow(std::max(0.0, mirrored), 30) : 0;
                for (int c = 0; c < 3; ++c)
                    scene.stack.images[i](y, x)[c] +=
                        static_cast<float>(gloss * lights[i].intensity[c]) + noise(random);
            }
    EXPECT_LE(worst_error(estimate_intensities(scene.stack, without_intensities(lights)).lights, lights), 0.03);
}

TEST(SemiCalibrated, EqualLampsStayEqualAndUnusedOnesAreLeftAlone) {
    Lights lights = without_intensities(uneven_lights(9));
    const test::TexturedSphere scene = lit_by(lights);
    lights[4].used = false;
    lights[4].intensity.setConstant(7);
    const SemiCalibratedResult result = estimate_intensities(scene.stack, lights);
    EXPECT_LE(worst_error(result.lights, lights), 0.005);
    EXPECT_EQ(result.lights[4].intensity, Eigen::Vector3d(7, 7, 7));
}

TEST(SemiCalibrated, TheSameBitsOnAnyNumberOfThreads) {
    const Lights lights = uneven_lights(9);
    const test::TexturedSphere scene = lit_by(lights, 48);
    WorkContext one, four;
    one.threads = 1;
    four.threads = 4;
    const Lights a = estimate_intensities(scene.stack, without_intensities(lights), {}, one).lights;
    const Lights b = estimate_intensities(scene.stack, without_intensities(lights), {}, four).lights;
    for (std::size_t i = 0; i < a.size(); ++i) EXPECT_EQ(a[i].intensity, b[i].intensity);
}

/// Uneven lamps 150 mm from the centre of a sphere of 47 mm radius.
test::LitSphere lit_by_near_lamps() {
    Lights lights = uneven_lights(12);
    for (Light& light : lights) light.near = LampPosition{light.direction * 150, {0, 0, 0}};
    return {lights, test::lambert, 96, 75};
}

TEST(SemiCalibrated, NearLampsReachEachPixelInTheirOwnWay) {
    const test::LitSphere scene = lit_by_near_lamps();
    SemiCalibratedOptions options;
    options.geometry.view = scene.view();
    options.geometry.height_mm = scene.height_mm();
    const Lights equal = without_intensities(scene.lights);
    EXPECT_LE(worst_error(estimate_intensities(scene.stack, equal, options).lights, scene.lights), 0.005);
    Lights distant = equal;
    for (Light& light : distant) light.near.reset();
    EXPECT_GE(worst_error(estimate_intensities(scene.stack, distant).lights, scene.lights), 0.05)
        << "the scene must tell near lamps from distant ones";
    EXPECT_THAT(test::input_error_of([&] { estimate_intensities(scene.stack, equal); }), HasSubstr("near"));
}

TEST(SemiCalibrated, RowsThatWereLeftOutDoNotMoveTheOthers) {
    const test::LitSphere scene = lit_by_near_lamps();
    SemiCalibratedOptions options;
    options.geometry.view = scene.view();
    options.geometry.height_mm = scene.height_mm();
    options.row_step = 3;
    const auto every_third = [](const cv::Mat& whole) {
        cv::Mat kept;
        for (int row = 0; row < whole.rows; row += 3) kept.push_back(whole.row(row));
        return kept;
    };
    PhotoStack few;
    few.mask = every_third(scene.stack.mask);
    few.files = scene.stack.files;
    for (const cv::Mat3f& image : scene.stack.images) few.images.emplace_back(every_third(image));
    for (const cv::Mat1b& clipped : scene.stack.clipped) few.clipped.emplace_back(every_third(clipped));
    const Lights equal = without_intensities(scene.lights);
    EXPECT_LE(worst_error(estimate_intensities(few, equal, options).lights, scene.lights), 0.005);
}

TEST(SemiCalibrated, WhatLeavesIntensitiesOpenIsAnError) {
    const Lights lights = uneven_lights(9);
    test::TexturedSphere plane = lit_by(lights, 32);
    for (std::size_t i = 0; i < lights.size(); ++i) {
        const double z = lights[i].direction.z() * lights[i].intensity[0];
        plane.stack.images[i].setTo(cv::Scalar::all(0.5 * z));
    }
    EXPECT_THAT(test::input_error_of([&] { estimate_intensities(plane.stack, lights); }), HasSubstr("own shape"));

    test::TexturedSphere dark = lit_by(lights, 32);
    dark.stack.images[3].setTo(cv::Scalar::all(0));
    EXPECT_THAT(test::input_error_of([&] { estimate_intensities(dark.stack, lights); }),
                HasSubstr("ring-3.png is dark"));

    Lights three = test::ring_of_lights(3);
    const test::TexturedSphere scene = lit_by(three, 32);
    EXPECT_THAT(test::input_error_of([&] { estimate_intensities(scene.stack, three); }), HasSubstr("from 3 lights"));
}

}  // namespace
}  // namespace darkbox
