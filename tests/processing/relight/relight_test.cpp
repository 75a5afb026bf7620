#include "processing/relight/relighter.h"

#include <gmock/gmock.h>

#include <cmath>

#include "acquisition/frame/error.h"
#include "tests/processing/relight/sphere_scene.h"

namespace darkbox {
namespace {

using test::largest_difference;
using test::light_from;
using test::sphere_scene;

RelightOptions phong(Lookup lookup = Lookup::thesis) {
    RelightOptions options;
    options.model = ReflectanceModel::phong;
    options.lookup = lookup;
    return options;
}

TEST(Relight, PredictsALambertPhotographUnderALightNeverSeen) {
    const RelightScene scene = sphere_scene(101);
    for (const Light& light : {light_from(0, 0, 1), light_from(-0.3, 0.8, 0.4), light_from(1, 0.1, -0.3)}) {
        const cv::Mat3f truth = test::lambert_photograph(scene.normals, scene.albedo, light);
        EXPECT_LT(largest_difference(relight(scene, {light}).image, truth), 2e-6);
    }
}

TEST(Relight, ThesisLookupShowsTheTexelsMean) {
    const RelightScene scene = sphere_scene(101);
    RelightOptions options;
    options.lookup = Lookup::thesis;
    const cv::Mat3f image = relight(scene, {light_from(0, 0, 1)}, options).image;
    const cv::Vec3f mean = scene.shading.mean_albedo(scene.index.label(40, 50) - 1, 0);
    for (int c = 0; c < 3; ++c) EXPECT_NEAR(image(40, 50)[c], mean[c] * scene.normals.normal(40, 50)[2], 1e-6);
}

TEST(Relight, FarSideIsBlack) {
    const RelightScene scene = sphere_scene(101);
    for (const RelightOptions& options : {RelightOptions(), phong()}) {
        const cv::Mat3f image = relight(scene, {light_from(1, 0, 0)}, options).image;
        EXPECT_EQ(cv::norm(image(cv::Rect(0, 0, 50, 101)), cv::NORM_INF), 0);
        EXPECT_GT(cv::norm(image(cv::Rect(60, 30, 30, 40)), cv::NORM_INF), 0.1);
    }
}

TEST(Relight, OutsideTheObjectIsBlack) {
    RelightScene scene = sphere_scene(61);
    scene.normals.valid(30, 30) = 0;
    const cv::Mat3f image = relight(scene, {light_from(0, 0, 1)}).image;
    EXPECT_EQ(image(0, 0), cv::Vec3f(0, 0, 0));
    EXPECT_EQ(image(30, 30), cv::Vec3f(0, 0, 0));
    EXPECT_GT(image(30, 31)[0], 0);
}

TEST(Relight, LightsAddUp) {
    const RelightScene scene = sphere_scene(61);
    Light red = light_from(0.8, 0.2, 0.5);
    red.intensity = {1.5, 0, 0};
    Light blue = light_from(-0.5, 0.5, 0.7);
    blue.intensity = {0, 0.2, 2};
    for (const RelightOptions& options : {RelightOptions(), phong()}) {
        const cv::Mat3f both = relight(scene, {red, blue}, options).image;
        const cv::Mat apart = relight(scene, {red}, options).image + relight(scene, {blue}, options).image;
        EXPECT_LT(largest_difference(both, apart), 1e-6);
    }
}

TEST(Relight, IntensityAndExposureScale) {
    const RelightScene scene = sphere_scene(61);
    Light light = light_from(0.1, 0.2, 1);
    const cv::Mat3f once = relight(scene, {light}).image;
    light.intensity *= 1.5;
    RelightOptions options;
    options.exposure = 2;
    EXPECT_LT(largest_difference(relight(scene, {light}, options).image, once * 3), 2e-6);
}

TEST(Relight, LeavesUnusedLightsOut) {
    const RelightScene scene = sphere_scene(61);
    Light off = light_from(1, 0, 0);
    off.used = false;
    const Light on = light_from(0, 1, 1);
    EXPECT_EQ(largest_difference(relight(scene, {on, off}).image, relight(scene, {on}).image), 0);
}

TEST(Relight, PhongIsItsFormula) {
    const RelightScene scene = sphere_scene(101);
    const Light light = light_from(0.4, 0.3, 0.8);
    const cv::Vec3d l(light.direction[0], light.direction[1], light.direction[2]);
    const cv::Mat3f image = relight(scene, {light}, phong()).image;
    for (const cv::Point p : {cv::Point(50, 50), cv::Point(60, 42), cv::Point(70, 40), cv::Point(30, 70)}) {
        const cv::Vec3d n(scene.normals.normal(p));
        const cv::Vec3d mirrored = 2 * n.dot(l) * n - l;
        const double r = 0.7 * n.dot(l) + 0.3 * std::pow(std::max(0.0, mirrored[2]), 20);
        ASSERT_GT(n.dot(l), 0);
        const cv::Vec3f mean = scene.shading.mean_albedo(scene.index.label(p) - 1, 0);
        EXPECT_NEAR(image(p)[1], mean[1] * r, 1e-5);
    }
}

TEST(Relight, PhongHighlightSitsHalfWayToTheLight) {
    RelightScene scene = sphere_scene(201);
    scene.shading.mean_albedo.setTo(cv::Scalar(1, 1, 1));
    for (int k = 0; k < scene.shading.texels; ++k)
        for (int level = 0; level < scene.shading.levels; ++level)
            scene.shading.radiance(k, level) = cv::Vec3f::all(0.1F * static_cast<float>(level));
    RelightOptions options = phong();
    options.phong_diffuse = 0;
    options.phong_specular = 1;
    options.phong_exponent = 100;
    const Light light = light_from(0.6, 0, 0.8);
    const cv::Mat1f grey = mean_channel(relight(scene, {light}, options).image);
    cv::Point brightest;
    cv::minMaxLoc(grey, nullptr, nullptr, nullptr, &brightest);
    const Eigen::Vector3d half = (light.direction + Eigen::Vector3d(0, 0, 1)).normalized();
    EXPECT_NEAR(brightest.x, 100 + 0.47 * 201 * half.x(), 1.0);
    EXPECT_NEAR(brightest.y, 100, 1.0);
}

TEST(Relight, ConstantCoefficientGrowsLinearly) {
    const RelightScene scene = sphere_scene(61);
    const Relighter relighter(scene);
    const auto at = [&](double r) {
        cv::Mat3f image(relighter.size());
        relighter.render(ConstantCoefficient{r}, {}, image);
        return image;
    };
    const cv::Mat3f full = at(1.0);
    EXPECT_LT(largest_difference(full, scene.albedo.albedo), 1e-6);
    EXPECT_LT(largest_difference(at(0.37), full * 0.37), 1e-6);
    EXPECT_EQ(cv::norm(at(0.0), cv::NORM_INF), 0);
    EXPECT_THROW(at(1.1), InputError);
    cv::Mat3b bytes(relighter.size());
    relighter.render(ConstantCoefficient{0.37}, {}, Encoding::linear, bytes);
    cv::Mat3b linear;
    at(0.37).convertTo(linear, CV_8U, 255);
    EXPECT_LE(largest_difference(bytes, linear), 1);
}

TEST(Relight, TexelWithoutAlbedoKeepsItsShading) {
    RelightScene scene = sphere_scene(61);
    scene.shading.mean_albedo.setTo(cv::Scalar(0, 0, 0));
    RelightOptions thesis;
    thesis.lookup = Lookup::thesis;
    const Lights lights{light_from(0, 0, 1)};
    EXPECT_EQ(largest_difference(relight(scene, lights).image, relight(scene, lights, thesis).image), 0);
}

TEST(Relight, SameBitsOnAnyNumberOfThreads) {
    const RelightScene scene = sphere_scene(120);
    const Lights lights = test::ring_of_lights(3);
    WorkContext work;
    work.threads = 1;
    const cv::Mat3f one = relight(scene, lights, phong(Lookup::detail), work).image;
    for (const int threads : {2, 8}) {
        work.threads = threads;
        EXPECT_EQ(largest_difference(one, relight(scene, lights, phong(Lookup::detail), work).image), 0);
    }
}

TEST(Relight, RefusesLightsThatCannotBe) {
    const RelightScene scene = sphere_scene(31);
    Light light = light_from(0, 0, 1);
    light.direction = {0, 0, 0};
    EXPECT_THROW(relight(scene, {light}), InputError);
    light.direction = {0, 0, 2};
    EXPECT_THROW(relight(scene, {light}), InputError);
    light.direction = {0, std::nan(""), 1};
    EXPECT_THROW(relight(scene, {light}), InputError);
    light = light_from(0, 0, 1);
    light.intensity = {1, -1, 1};
    EXPECT_THROW(relight(scene, {light}), InputError);
    EXPECT_THROW(relight(scene, Lights{}), InputError);
}

TEST(Relight, RefusesScenesThatDoNotFitTogether) {
    const Lights lights{light_from(0, 0, 1)};
    const auto broken = [&](auto change) {
        RelightScene scene = sphere_scene(31);
        change(scene);
        EXPECT_THROW(relight(scene, lights), InputError);
    };
    broken([](RelightScene& s) { s = {}; });
    broken([](RelightScene& s) { s.normals.normal = cv::Mat3f(31, 30); });
    broken([](RelightScene& s) { s.albedo.valid = cv::Mat1b(30, 31); });
    broken([](RelightScene& s) { s.index.label(15, 15) = 7; });
    broken([](RelightScene& s) { s.shading.texels = 5; });
    broken([](RelightScene& s) { s.shading.radiance = cv::Mat3f(6, 10); });
    broken([](RelightScene& s) { s.shading.radiance(2, 2)[1] = std::nanf(""); });
    broken([](RelightScene& s) { s.normals.normal(15, 15)[0] = std::nanf(""); });
    broken([](RelightScene& s) { s.normals.normal(15, 15) *= 2; });
}

TEST(RelightOptions, NameTheFieldAndItsRange) {
    RelightOptions options;
    options.phong_specular = 1.5;
    EXPECT_THAT([&] { options.validate(); },
                testing::ThrowsMessage<InputError>(testing::HasSubstr("phong_specular is 1.5, allowed are 0...1")));
    options = {};
    options.exposure = std::nan("");
    EXPECT_THROW(options.validate(), InputError);
}

}  // namespace
}  // namespace darkbox
