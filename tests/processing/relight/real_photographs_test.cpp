#include "tests/support/real_photographs.h"

#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/core.hpp>

#include "processing/normals/photometric_stereo.h"
#include "processing/relight/relight.h"
#include "processing/shading/shading.h"
#include "processing/texels/texels.h"
#include "tests/support/test_data.h"

namespace darkbox {
namespace {

/// Every map that relighting needs, from photographs with known lights.
RelightScene fit(const PhotoStack& stack, const Lights& lights) {
    const PhotometricStereoResult stereo = photometric_stereo(stack, lights);
    const TexelResult texels = cluster_texels(stereo.albedo);
    return {stereo.normals, stereo.albedo, texels.index,
            shading_maps(stack, lights, stereo.normals, stereo.albedo, texels.index).maps};
}

/// RMSE over the object relative to the photograph's mean, in the channel mean.
double relative_rmse(const cv::Mat3f& picture, const cv::Mat3f& photograph, const cv::Mat1b& mask) {
    const cv::Mat difference = mean_channel(picture) - mean_channel(photograph);
    const double rms = cv::norm(difference, cv::NORM_L2, mask) / std::sqrt(cv::countNonZero(mask));
    return rms / cv::mean(mean_channel(photograph), mask)[0];
}

/// The mean over all lights of relighting with a light's direction against its photograph.
double mean_error(const PhotoStack& stack, const Lights& lights, const RelightScene& scene) {
    double sum = 0;
    for (std::size_t i = 0; i < lights.size(); ++i)
        sum += relative_rmse(relight(scene, {lights[i]}).image, stack.images[i], stack.mask);
    return sum / static_cast<double>(lights.size());
}

class RealPhotographs : public testing::TestWithParam<const char*> {};

TEST_P(RealPhotographs, AreMadeAgainByTheirOwnLights) {
    DARKBOX_NEED_DATA(folder, "psm");
    const PhotoStack stack = test::read_photographs(folder / GetParam());
    const Lights lights = test::read_lights(folder / "lights_reference.txt");
    const double error = mean_error(stack, lights, fit(stack, lights));
    RecordProperty("relative_rmse", std::to_string(error));
    EXPECT_LT(error, 0.1);
}

TEST_P(RealPhotographs, ShadingMapsDoBetterThanLambert) {
    DARKBOX_NEED_DATA(folder, "psm");
    const PhotoStack stack = test::read_photographs(folder / GetParam());
    const Lights lights = test::read_lights(folder / "lights_reference.txt");
    RelightScene scene = fit(stack, lights);
    const double measured = mean_error(stack, lights, scene);
    for (int k = 0; k < scene.shading.texels; ++k)
        for (int i = 0; i < scene.shading.levels; ++i)
            scene.shading.radiance(k, i) = scene.shading.mean_albedo(k, 0) *
                                           (static_cast<float>(i) / static_cast<float>(scene.shading.levels - 1));
    const double lambert = mean_error(stack, lights, scene);
    RecordProperty("lambert", std::to_string(lambert));
    EXPECT_LT(measured, lambert);
}

TEST_P(RealPhotographs, PredictALightHeldOut) {
    DARKBOX_NEED_DATA(folder, "psm");
    PhotoStack stack = test::read_photographs(folder / GetParam());
    const Lights lights = test::read_lights(folder / "lights_reference.txt");
    constexpr std::size_t held = 8;  // inside the hull of the others
    Lights others = lights;
    others[held].used = false;
    const double error =
        relative_rmse(relight(fit(stack, others), {lights[held]}).image, stack.images[held], stack.mask);
    RecordProperty("held_out", std::to_string(error));
    EXPECT_LT(error, 0.1);
}

INSTANTIATE_TEST_SUITE_P(Objects, RealPhotographs, testing::Values("gray", "cat", "buddha", "owl"),
                         [](const auto& object) { return std::string(object.param); });

}  // namespace
}  // namespace darkbox
