// Near lights: directions and fall-off per pixel, for both solvers.

#include <gtest/gtest.h>

#include "acquisition/frame/error.h"
#include "tests/processing/normals/lit_sphere.h"

namespace darkbox {
namespace {

/// Lamps 150 mm from the centre of a sphere of 23.5 mm: distant lights would be badly wrong.
Lights near_lamps(int count) {
    Lights lights = test::spiral_lights(count, 50);
    for (Light& light : lights) light.near = LampPosition{light.direction * 150, {0, 0, 0}};
    return lights;
}

PhotometricStereoOptions options_for(Solver solver, const test::LitSphere& sphere) {
    PhotometricStereoOptions options;
    options.solver = solver;
    options.geometry.view = sphere.view();
    return options;
}

class NearLights : public testing::TestWithParam<Solver> {};

TEST_P(NearLights, ExactWhereTheHeightIsKnown) {
    const test::LitSphere sphere(near_lamps(12), test::lambert, 48, 25);
    PhotometricStereoOptions options = options_for(GetParam(), sphere);
    options.geometry.height_mm = sphere.height_mm();
    const auto result = photometric_stereo(sphere.stack, sphere.lights, options);
    EXPECT_LE(test::quantile(sphere.errors_deg(result), 1.0), 0.02);
    EXPECT_NEAR(result.albedo.albedo(24, 24)[0], 0.6, 1e-3);
}

TEST_P(NearLights, ThePlaneOfTheObjectIsBetterThanDistantLights) {
    const test::LitSphere sphere(near_lamps(12), test::lambert, 48, 25);
    Lights distant = sphere.lights;
    for (Light& light : distant) light.near.reset();
    const auto near = photometric_stereo(sphere.stack, sphere.lights, options_for(GetParam(), sphere));
    const auto far = photometric_stereo(sphere.stack, distant, options_for(GetParam(), sphere));
    EXPECT_LT(test::mean_of(sphere.errors_deg(near)), 0.5 * test::mean_of(sphere.errors_deg(far)));
}

TEST_P(NearLights, RowsOfLowerBandsKeepTheirPlace) {
    const test::LitSphere sphere(near_lamps(8), test::lambert, 48, 25);
    PhotometricStereoOptions options = options_for(GetParam(), sphere);
    options.geometry.height_mm = sphere.height_mm();
    options.band_rows = 7;
    EXPECT_LE(test::quantile(sphere.errors_deg(photometric_stereo(sphere.stack, sphere.lights, options)), 1.0), 0.02);
}

TEST_P(NearLights, NeedTheView) {
    const test::LitSphere sphere(near_lamps(6), test::lambert, 24);
    PhotometricStereoOptions options;
    options.solver = GetParam();
    EXPECT_THROW(photometric_stereo(sphere.stack, sphere.lights, options), InputError);
}

TEST_P(NearLights, HeightOfAnotherSizeIsAnError) {
    const test::LitSphere sphere(near_lamps(6), test::lambert, 24);
    PhotometricStereoOptions options = options_for(GetParam(), sphere);
    options.geometry.height_mm = cv::Mat1f(5, 5, 0.0F);
    EXPECT_THROW(photometric_stereo(sphere.stack, sphere.lights, options), InputError);
}

INSTANTIATE_TEST_SUITE_P(BothSolvers, NearLights, testing::Values(Solver::lsq, Solver::robust),
                         [](const auto& which) { return which.param == Solver::lsq ? "lsq" : "robust"; });

}  // namespace
}  // namespace darkbox
