#include "processing/pipeline/held_out.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>

#include "processing/normals/semi_calibrated.h"
#include "tests/processing/normals/lit_sphere.h"
#include "tests/support/textured_sphere.h"
#include "tests/support/throws.h"

namespace darkbox {
namespace {

constexpr std::size_t all = 0, lit = 1, shadowed = 2, highlight = 3;

/// A sphere of which only what every light reaches is looked at: least squares is exact there. Seven lights on a ring
/// and one on its axis.
test::TexturedSphere fully_lit_sphere() {
    test::TexturedSphere scene = test::textured_sphere(64, 8);
    Light& axis = scene.lights.back();
    axis.direction = {0.02, 0.01, 1};
    axis.direction.normalize();
    scene.stack.images.back() = test::lambert_photograph(scene.normals, scene.albedo, axis);
    for (int y = 0; y < 64; ++y)
        for (int x = 0; x < 64; ++x)
            if (scene.normals.normal(y, x)[2] < 0.7F) scene.stack.mask(y, x) = 0;
    return scene;
}

std::vector<HeldOutLight> held_out(const test::TexturedSphere& scene) {
    return leave_one_light_out(scene.stack, scene.lights, photometric_stereo(scene.stack, scene.lights),
                               {lambert_predictor()});
}

TEST(HeldOut, LambertPredictsALambertSphereExactly) {
    const auto lights = held_out(fully_lit_sphere());
    ASSERT_EQ(lights.size(), 8u);
    for (const HeldOutLight& light : lights) {
        ASSERT_TRUE(light.errors.at(0)[all] && light.errors[0][lit]) << light.file;
        EXPECT_LT(light.errors[0][all]->rmse_relative, 1e-5) << light.file;
        EXPECT_GT(light.errors[0][all]->psnr_db, 100) << light.file;
        EXPECT_FALSE(light.errors[0][shadowed]);
        EXPECT_FALSE(light.errors[0][highlight]);
        EXPECT_LT(light.normal_change_deg, 1e-3);
    }
}

TEST(HeldOut, NearLightsFallOnTheSurface) {
    Lights lamps = test::spiral_lights(8, 50);
    for (Light& light : lamps) light.near = LampPosition{light.direction * 150, {0, 0, 0}};
    test::LitSphere sphere(lamps, test::lambert, 48, 25);
    for (int y = 0; y < 48; ++y)
        for (int x = 0; x < 48; ++x)
            if (std::hypot(x - 23.5, y - 23.5) > 10) sphere.stack.mask(y, x) = 0;  // the rest is not lit by all
    PhotometricStereoOptions options;
    options.geometry = {sphere.view(), sphere.height_mm()};
    const auto reference = photometric_stereo(sphere.stack, sphere.lights, options);
    for (const HeldOutLight& light : leave_one_light_out(
             sphere.stack, sphere.lights, reference,
             {lambert_predictor(), darkbox_predictor(Lookup::thesis), darkbox_predictor(Lookup::detail)}, options)) {
        for (const PredictionErrors& errors : light.errors) EXPECT_LT(errors[all]->rmse_relative, 1e-4) << light.file;
        EXPECT_FALSE(light.errors[0][shadowed] || light.errors[0][highlight]);
    }
}

TEST(HeldOut, TheErrorIsRelativeToThePhotographsMean) {
    test::TexturedSphere scene = fully_lit_sphere();
    scene.stack.images[2] *= 1.1;  // every sample a tenth too bright
    const auto lights = held_out(scene);
    double squares = 0, sum = 0;
    int samples = 0;
    for (int y = 0; y < 64; ++y)
        for (int x = 0; x < 64; ++x)
            for (int c = 0; c < 3 && scene.stack.mask(y, x) != 0; ++c, ++samples) {
                const double observed = scene.stack.images[2](y, x)[c];
                squares += std::pow(observed - observed / 1.1, 2);
                sum += observed;
            }
    const double rms = std::sqrt(squares / samples);
    EXPECT_NEAR(lights[2].errors[0][all]->rmse_relative, rms / (sum / samples), 1e-5);
    EXPECT_NEAR(lights[2].errors[0][all]->psnr_db, -20 * std::log10(rms), 1e-3);
    EXPECT_GT(lights[2].normal_change_deg, 0.1);
}

TEST(HeldOut, NothingOfTheHeldOutPhotographIsLearnt) {
    test::TexturedSphere scene = fully_lit_sphere();
    std::vector<cv::Mat3f> normals;
    const Predictor spy{"spy", [&normals](const HeldOutTraining& training, const Light& light, const WorkContext&) {
                            if (light.file == "ring-3.png") normals.push_back(training.scene.normals.normal.clone());
                            return std::optional(training.stack.images.front());
                        }};
    const PhotometricStereoResult reference = photometric_stereo(scene.stack, scene.lights);
    leave_one_light_out(scene.stack, scene.lights, reference, {spy});
    scene.stack.images[3] = cv::Vec3f(0.9F, 0.1F, 0.4F);
    leave_one_light_out(scene.stack, scene.lights, reference, {spy});
    ASSERT_EQ(normals.size(), 2u);
    EXPECT_EQ(std::memcmp(normals[0].data, normals[1].data, normals[0].total() * sizeof(cv::Vec3f)), 0);
}

TEST(HeldOut, EstimatedIntensitiesAreEstimatedAgainWithoutTheHeldOutPhotograph) {
    test::TexturedSphere scene = fully_lit_sphere();
    std::vector<Eigen::Vector3d> intensities;
    const Predictor spy{"spy", [&](const HeldOutTraining& training, const Light& light, const WorkContext&) {
                            for (const Light& other : training.lights)
                                if (light.file == "ring-3.png" && other.used) intensities.push_back(other.intensity);
                            return std::optional(training.stack.images.front());
                        }};
    const auto record = [&] {
        scene.lights = estimate_intensities(scene.stack, scene.lights).lights;
        leave_one_light_out(scene.stack, scene.lights, photometric_stereo(scene.stack, scene.lights), {spy}, {},
                            HeldOutIntensities::estimated);
    };
    record();
    const double whole = scene.lights[0].intensity[0];
    scene.stack.images[3] += scene.stack.images[5];
    record();
    EXPECT_GT(std::abs(scene.lights[0].intensity[0] - whole), 1e-3);  // there was something to leak
    ASSERT_EQ(intensities.size(), 14u);
    for (std::size_t i = 0; i < 7; ++i) EXPECT_EQ(intensities[i], intensities[i + 7]) << i;
}

TEST(HeldOut, PredictsExactlyWithEstimatedIntensities) {
    test::TexturedSphere scene = fully_lit_sphere();
    scene.lights = estimate_intensities(scene.stack, scene.lights).lights;
    const auto lights = leave_one_light_out(scene.stack, scene.lights, photometric_stereo(scene.stack, scene.lights),
                                            {lambert_predictor()}, {}, HeldOutIntensities::estimated);
    for (const HeldOutLight& light : lights) EXPECT_LT(light.errors.at(0)[all]->rmse_relative, 1e-4) << light.file;
}

TEST(HeldOut, PredictorsStandBesideEachOther) {
    const test::TexturedSphere scene = fully_lit_sphere();
    const Predictor black{"black", [](const HeldOutTraining& training, const Light&, const WorkContext&) {
                              return std::optional(cv::Mat3f(training.stack.size(), cv::Vec3f::all(0)));
                          }};
    const auto lights = leave_one_light_out(scene.stack, scene.lights, photometric_stereo(scene.stack, scene.lights),
                                            {lambert_predictor(), black});
    ASSERT_EQ(lights[0].errors.size(), 2u);
    EXPECT_GT(lights[0].errors[1][all]->rmse_relative, 1.0);  // a black picture misses all of the mean and more
}

TEST(HeldOut, ShadingMapsPredictALambertSphereExactly) {
    const test::TexturedSphere scene = fully_lit_sphere();
    const auto lights = leave_one_light_out(scene.stack, scene.lights, photometric_stereo(scene.stack, scene.lights),
                                            every_predictor());
    const double detail = mean_errors(lights, 1, LightGroup::every).errors[all]->rmse_relative;
    EXPECT_LT(detail, 1e-4);
    EXPECT_LT(detail, mean_errors(lights, 0, LightGroup::every).errors[all]->rmse_relative);
    EXPECT_LT(detail, mean_errors(lights, 3, LightGroup::every).errors[all]->rmse_relative);
}

TEST(HeldOut, ShadowsHighlightsAndClippingAreToldApart) {
    test::TexturedSphere scene = fully_lit_sphere();
    const PhotometricStereoResult reference = photometric_stereo(scene.stack, scene.lights);
    const cv::Vec3f white(1, 1, 1);
    scene.stack.images[0](30, 30) = cv::Vec3f(0, 0, 0);  // a cast shadow
    scene.stack.images[0](31, 31) = white;               // a highlight below full scale would do as well
    scene.stack.clipped[0](32, 32) = 255;
    const auto light = leave_one_light_out(scene.stack, scene.lights, reference, {lambert_predictor()}).front();
    EXPECT_EQ(light.errors[0][shadowed]->pixels, 1u);
    EXPECT_EQ(light.errors[0][highlight]->pixels, 2u);
    EXPECT_EQ(light.errors[0][lit]->pixels + 3, light.errors[0][all]->pixels);
}

TEST(HeldOut, ABrighterPredictionIsNoErrorWhereThePhotographIsClipped) {
    test::TexturedSphere scene = fully_lit_sphere();
    scene.stack.clipped[0] = scene.stack.mask.clone();
    scene.stack.images[0] *= 0.5;  // as if the sensor had ended there
    const auto light = held_out(scene).front();
    EXPECT_LT(light.errors[0][all]->rmse_relative, 1e-5);
}

TEST(HeldOut, TheHullIsMadeOfTheOutermostLights) {
    const auto lights = held_out(fully_lit_sphere());
    for (std::size_t i = 0; i < 7; ++i) EXPECT_TRUE(lights[i].hull) << i;
    EXPECT_FALSE(lights[7].hull);
    const auto interior = mean_errors(lights, 0, LightGroup::interior);
    EXPECT_EQ(interior.errors[all]->pixels, lights[7].errors[0][all]->pixels);
    EXPECT_EQ(mean_errors(lights, 0, LightGroup::every).errors[all]->pixels,
              mean_errors(lights, 0, LightGroup::hull).errors[all]->pixels + interior.errors[all]->pixels);
}

TEST(HeldOut, ALightThatTheOthersCannotDoWithoutHasNoErrors) {
    test::TexturedSphere scene = fully_lit_sphere();
    for (std::size_t i = 0; i < 8; ++i) scene.lights[i].used = i < 4;
    scene.lights[0].direction = Eigen::Vector3d(-0.5, 0, 1).normalized();
    scene.lights[1].direction = Eigen::Vector3d(0, 0, 1);
    scene.lights[2].direction = Eigen::Vector3d(0.5, 0, 1).normalized();
    scene.lights[3].direction = Eigen::Vector3d(0, 0.5, 1).normalized();
    const auto lights = held_out(scene);
    ASSERT_EQ(lights.size(), 4u);
    EXPECT_FALSE(lights[0].errors.empty());
    EXPECT_TRUE(lights[3].errors.empty());
}

TEST(HeldOut, IsTheSameOnAnyNumberOfThreads) {
    const test::TexturedSphere scene = test::textured_sphere(64, 8);
    const auto errors_on = [&scene](int threads) {
        WorkContext work;
        work.threads = threads;
        std::vector<double> errors;
        for (const HeldOutLight& light :
             leave_one_light_out(scene.stack, scene.lights, photometric_stereo(scene.stack, scene.lights),
                                 every_predictor(), {}, HeldOutIntensities::estimated, work))
            for (const PredictionErrors& of : light.errors) errors.push_back(of[all]->rmse_relative);
        return errors;
    };
    const std::vector<double> one = errors_on(1);
    EXPECT_EQ(one.size(), 8u * 4u);
    EXPECT_EQ(errors_on(2), one);
    EXPECT_EQ(errors_on(8), one);
}

TEST(HeldOut, ThreeLightsAreTooFew) {
    test::TexturedSphere scene = fully_lit_sphere();
    for (std::size_t i = 3; i < 8; ++i) scene.lights[i].used = false;
    EXPECT_NE(test::input_error_of([&] { held_out(scene); }), "");
}

}  // namespace
}  // namespace darkbox
