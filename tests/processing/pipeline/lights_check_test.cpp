#include "processing/pipeline/lights_check.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "processing/formats/light_files.h"
#include "processing/pipeline/import.h"
#include "processing/pipeline/stack.h"
#include "processing/pipeline/stages.h"
#include "tests/processing/normals/lit_sphere.h"
#include "tests/support/test_data.h"

namespace darkbox {
namespace {

Lights reversed(Lights lights) {
    for (std::size_t i = 0, j = lights.size(); i + 1 < j; ++i) std::swap(lights[i].direction, lights[--j].direction);
    return lights;
}

TEST(LightsCheck, TheRightLightsLeaveWhatTheBestThreeImagesLeave) {
    const test::LitSphere sphere(test::spiral_lights(12, 30), test::lambert, 48, 55);
    const auto fit = lights_fit(sphere.stack, sphere.lights);
    ASSERT_TRUE(fit);
    EXPECT_NEAR(fit->given, 0, 1e-6);
    EXPECT_NEAR(fit->free, 0, 1e-6);
    EXPECT_GT(fit->shuffled, 0.1);
    EXPECT_LT(fit->excess(), 1e-4);
}

TEST(LightsCheck, ShadowsAndGlossAreNoContradiction) {
    const auto glossy = [](const Eigen::Vector3d& n, const Eigen::Vector3d& l, const Eigen::Vector3d& v) {
        return test::lambert(n, l, v) + 0.6 * std::pow(std::max(0.0, n.dot((l + v).normalized())), 40);
    };
    const test::LitSphere sphere(test::spiral_lights(12, 70), glossy);
    EXPECT_LT(lights_fit(sphere.stack, sphere.lights)->excess(), 0.3);
    EXPECT_FALSE(lights_warning(sphere.stack, sphere.lights));
}

TEST(LightsCheck, LightsInReverseContradictThePhotographs) {
    const test::LitSphere sphere(test::spiral_lights(12), test::lambert);
    EXPECT_GT(lights_fit(sphere.stack, reversed(sphere.lights))->excess(), 0.7);
    EXPECT_TRUE(lights_warning(sphere.stack, reversed(sphere.lights)));
}

TEST(LightsCheck, TooFewLightsOrPixelsTellNothing) {
    const test::LitSphere sphere(test::spiral_lights(4), test::lambert);
    EXPECT_FALSE(lights_fit(sphere.stack, sphere.lights));
    test::LitSphere clipped(test::spiral_lights(12), test::lambert);
    clipped.stack.clipped[3].setTo(255);
    EXPECT_FALSE(lights_fit(clipped.stack, clipped.lights));
}

/// Real photographs: docs/decisions/0055 has the figures.
TEST(LightsCheck, RealPhotographsUnderTheirLightsAndInReverse) {
    DARKBOX_NEED_DATA(psm, "psm");
    const Lights lights = read_lights(psm / "lights_reference.txt").lights;
    for (const char* object : {"gray", "cat", "buddha", "owl"}) {
        test::TemporaryFolder folder;
        ImportOptions options;
        options.folders = {psm / object};
        options.mask = psm / object / "mask.png";
        options.transfer = ImportTransfer::linear;
        options.out = folder.path() / "s";
        const PhotoStack stack = load_stack(import_photographs(options));
        EXPECT_LT(lights_fit(stack, lights)->excess(), 0.4) << object;
        EXPECT_GT(lights_fit(stack, reversed(lights))->excess(), 0.8) << object;
        EXPECT_FALSE(lights_warning(stack, lights)) << object;
        EXPECT_TRUE(lights_warning(stack, reversed(lights))) << object;
    }
}

}  // namespace
}  // namespace darkbox
