#include "processing/normals/photometric_stereo.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <numbers>
#include <random>

#include "acquisition/frame/error.h"
#include "tests/processing/normals/lit_sphere.h"

namespace darkbox {
namespace {

using test::same_bits;

constexpr int side = 65;
constexpr double sphere_radius = 30;
const Eigen::Vector3d true_albedo(0.6, 0.4, 0.2);

/// n lights on a cone about the viewing direction.
Lights ring(int n, double slant_deg = 30) {
    Lights lights;
    const double slant = slant_deg * std::numbers::pi / 180;
    for (int i = 0; i < n; ++i) {
        const double turn = 2 * std::numbers::pi * i / n;
        Light light;
        light.file = "light" + std::to_string(i);
        light.direction = {std::sin(slant) * std::cos(turn), std::sin(slant) * std::sin(turn), std::cos(slant)};
        lights.push_back(light);
    }
    return lights;
}

/// Normal of the test sphere at a pixel, or z < 0 outside it.
Eigen::Vector3d sphere_normal(int row, int column) {
    const double x = (column - side / 2) / sphere_radius;
    const double y = -(row - side / 2) / sphere_radius;
    const double zz = 1 - x * x - y * y;
    return zz > 0 ? Eigen::Vector3d(x, y, std::sqrt(zz)) : Eigen::Vector3d(0, 0, -1);
}

bool lit_by_all(const Eigen::Vector3d& normal, const Lights& lights) {
    return std::all_of(lights.begin(), lights.end(), [&](const Light& l) { return normal.dot(l.direction) > 0; });
}

/// An exact Lambert sphere; radiance is rho (N.L)+ times the light's intensity.
PhotoStack lambert_sphere(const Lights& lights) {
    PhotoStack stack;
    stack.mask = cv::Mat1b(side, side, uchar{0});
    for (const Light& light : lights) {
        cv::Mat3f image(side, side, cv::Vec3f::all(0));
        for (int r = 0; r < side; ++r)
            for (int c = 0; c < side; ++c) {
                const Eigen::Vector3d normal = sphere_normal(r, c);
                if (normal.z() < 0) continue;
                stack.mask(r, c) = 255;
                const double shading = std::max(0.0, normal.dot(light.direction));
                for (int k = 0; k < 3; ++k)
                    image(r, c)[k] = static_cast<float>(true_albedo[k] * shading * light.intensity[k]);
            }
        stack.images.push_back(image);
        stack.clipped.emplace_back(side, side, uchar{0});
        stack.files.push_back(light.file);
    }
    return stack;
}

double error_deg(const NormalMap& map, int row, int column) {
    const cv::Vec3f& n = map.normal(row, column);
    return angle_deg({n[0], n[1], n[2]}, sphere_normal(row, column));
}

/// Worst error over the pixels that every light reaches.
double worst_lit_error_deg(const NormalMap& map, const Lights& lights) {
    double worst = 0;
    for (int r = 0; r < side; ++r)
        for (int c = 0; c < side; ++c) {
            const Eigen::Vector3d normal = sphere_normal(r, c);
            if (normal.z() < 0 || !lit_by_all(normal, lights)) continue;
            EXPECT_EQ(map.valid(r, c), 255);
            worst = std::max(worst, error_deg(map, r, c));
        }
    return worst;
}

TEST(PhotometricStereo, ExactLambertSphere) {
    const Lights lights = ring(8);
    const auto result = photometric_stereo(lambert_sphere(lights), lights);
    EXPECT_LE(worst_lit_error_deg(result.normals, lights), 0.01);
    EXPECT_EQ(result.lights_used(side / 2, side / 2), 8);
    EXPECT_LT(result.residual(side / 2, side / 2), 1e-6F);
}

TEST(PhotometricStereo, ThreeLightsAreEnough) {
    const Lights lights = ring(3);
    EXPECT_LE(worst_lit_error_deg(photometric_stereo(lambert_sphere(lights), lights).normals, lights), 0.01);
}

TEST(PhotometricStereo, NormalsAreUnitLengthAndZeroOutside) {
    const Lights lights = ring(8, 50);
    const auto result = photometric_stereo(lambert_sphere(lights), lights);
    for (int r = 0; r < side; ++r)
        for (int c = 0; c < side; ++c) {
            const float expected = result.normals.valid(r, c) ? 1.0F : 0.0F;
            EXPECT_NEAR(cv::norm(result.normals.normal(r, c)), expected, 1e-5);
        }
    EXPECT_EQ(result.normals.valid(0, 0), 0);
}

TEST(PhotometricStereo, AlbedoIsAbsoluteInEachChannel) {
    const Lights lights = ring(8);
    const auto result = photometric_stereo(lambert_sphere(lights), lights);
    for (int k = 0; k < 3; ++k) EXPECT_NEAR(result.albedo.albedo(side / 2, side / 2 + 8)[k], true_albedo[k], 1e-5);
}

TEST(PhotometricStereo, IntensitiesAreDividedOut) {
    Lights lights = ring(6);
    for (std::size_t i = 0; i < lights.size(); ++i)
        lights[i].intensity = {0.5 + 0.2 * static_cast<double>(i), 1.0, 2.0 - 0.2 * static_cast<double>(i)};
    const auto result = photometric_stereo(lambert_sphere(lights), lights);
    EXPECT_LE(worst_lit_error_deg(result.normals, lights), 0.01);
    for (int k = 0; k < 3; ++k) EXPECT_NEAR(result.albedo.albedo(side / 2, side / 2)[k], true_albedo[k], 1e-5);
}

TEST(PhotometricStereo, UnusedLightsTakeNoPart) {
    Lights lights = ring(8);
    PhotoStack stack = lambert_sphere(lights);
    stack.images[3].setTo(cv::Vec3f::all(1));
    lights[3].used = false;
    const auto result = photometric_stereo(stack, lights);
    EXPECT_LE(worst_lit_error_deg(result.normals, ring(8)), 0.01);
    EXPECT_EQ(result.lights_used(side / 2, side / 2), 7);
}

TEST(PhotometricStereo, ClippedSamplesAreLeftOutWhereEnoughRemain) {
    const Lights lights = ring(8);
    PhotoStack stack = lambert_sphere(lights);
    const cv::Point enough(side / 2 + 3, side / 2), too_few(side / 2 - 3, side / 2);
    for (std::size_t i = 0; i < 8; ++i) {
        if (i % 2 == 0) stack.images[i](enough) = cv::Vec3f::all(0.1F);
        stack.clipped[i](enough) = i % 2 == 0 ? 255 : 0;
        stack.clipped[i](too_few) = i < 6 ? 255 : 0;
    }
    const auto result = photometric_stereo(stack, lights);
    EXPECT_LE(error_deg(result.normals, enough.y, enough.x), 0.01);
    EXPECT_NEAR(result.albedo.albedo(enough)[0], true_albedo[0], 1e-5);
    EXPECT_EQ(result.lights_used(enough), 4);
    EXPECT_EQ(result.normals.valid(too_few), 0);
    EXPECT_EQ(result.lights_used(too_few), 0);
}

TEST(PhotometricStereo, ThereIsNoNormalWhereUnclippedSamplesLieInOnePlane) {
    Lights lights = ring(4);
    Light top;
    top.file = "top";
    lights.push_back(top);
    PhotoStack stack = lambert_sphere(lights);
    const cv::Point pixel(side / 2, side / 2);
    stack.clipped[1](pixel) = 255;
    stack.clipped[3](pixel) = 255;
    const auto result = photometric_stereo(stack, lights);
    EXPECT_EQ(result.lights_used(pixel), 0);
    EXPECT_EQ(result.normals.valid(pixel), 0);
}

TEST(PhotometricStereo, PixelsClippedInEveryPhotographHaveNoNormal) {
    const Lights lights = ring(8);
    PhotoStack stack = lambert_sphere(lights);
    for (cv::Mat1b& clipped : stack.clipped) clipped.setTo(255);
    for (const Solver solver : {Solver::lsq, Solver::robust}) {
        PhotometricStereoOptions options;
        options.solver = solver;
        EXPECT_EQ(photometric_stereo(stack, lights, options).pixels, 0U);
    }
}

TEST(PhotometricStereo, NoiseMovesNormalsByItsShare) {
    const Lights lights = ring(12, 45);
    PhotoStack stack = lambert_sphere(lights);
    std::mt19937 bits(7);
    for (cv::Mat3f& image : stack.images)
        for (cv::Vec3f& p : image)
            for (int k = 0; k < 3; ++k) p[k] += 0.01F * (static_cast<float>(bits()) / 4294967295.0F - 0.5F);
    const auto result = photometric_stereo(stack, lights);
    EXPECT_LE(worst_lit_error_deg(result.normals, lights), 1.0);
    EXPECT_GT(worst_lit_error_deg(result.normals, lights), 0.02);
    EXPECT_NEAR(result.residual(side / 2, side / 2), 0.01 / std::sqrt(12.0) / std::sqrt(3.0), 1e-3);
}

TEST(PhotometricStereo, SampleThatIsNotFiniteMakesItsPixelInvalid) {
    const Lights lights = ring(6);
    PhotoStack stack = lambert_sphere(lights);
    stack.images[2](side / 2, side / 2)[1] = std::numeric_limits<float>::quiet_NaN();
    stack.images[4](side / 2, side / 2 + 1)[0] = std::numeric_limits<float>::infinity();
    stack.clipped[4](side / 2, side / 2 + 1) = 255;
    const auto result = photometric_stereo(stack, lights);
    EXPECT_EQ(result.not_finite, 2U);
    EXPECT_EQ(result.normals.valid(side / 2, side / 2), 0);
    EXPECT_EQ(result.normals.valid(side / 2, side / 2 + 1), 0);
    EXPECT_TRUE(cv::checkRange(result.normals.normal));
    EXPECT_TRUE(cv::checkRange(result.albedo.albedo));
    EXPECT_TRUE(cv::checkRange(result.residual));
    EXPECT_TRUE(std::isfinite(result.residual_rms));
}

TEST(PhotometricStereo, BlackPixelsAreInvalid) {
    const Lights lights = ring(6);
    PhotoStack stack = lambert_sphere(lights);
    for (cv::Mat3f& image : stack.images) image(side / 2, side / 2) = cv::Vec3f::all(0);
    const auto result = photometric_stereo(stack, lights);
    EXPECT_EQ(result.normals.valid(side / 2, side / 2), 0);
    EXPECT_EQ(result.pixels, static_cast<std::size_t>(cv::countNonZero(result.normals.valid)));
}

TEST(PhotometricStereo, SameBitsOnAnyNumberOfThreads) {
    const Lights lights = ring(9, 60);
    const PhotoStack stack = lambert_sphere(lights);
    WorkContext one;
    one.threads = 1;
    const auto expected = photometric_stereo(stack, lights, {}, one);
    for (const int threads : {2, 8}) {
        WorkContext work;
        work.threads = threads;
        const auto result = photometric_stereo(stack, lights, {}, work);
        EXPECT_TRUE(same_bits(result.normals.normal, expected.normals.normal));
        EXPECT_TRUE(same_bits(result.albedo.albedo, expected.albedo.albedo));
        EXPECT_TRUE(same_bits(result.residual, expected.residual));
        EXPECT_EQ(result.residual_rms, expected.residual_rms);
    }
}

TEST(PhotometricStereo, TwoLightsAreAnError) {
    const Lights lights = ring(2);
    EXPECT_THROW(photometric_stereo(lambert_sphere(lights), lights), InputError);
}

TEST(PhotometricStereo, CoplanarLightsAreAnError) {
    Lights lights = ring(4);
    for (Light& light : lights) {
        light.direction.y() = 0;
        light.direction.normalize();
    }
    EXPECT_THROW(photometric_stereo(lambert_sphere(lights), lights), InputError);
}

TEST(PhotometricStereo, PhotographsOfAnotherSizeAreAnErrorThatNamesThem) {
    const Lights lights = ring(4);
    PhotoStack stack = lambert_sphere(lights);
    stack.images[2] = cv::Mat3f(3, 3);
    try {
        photometric_stereo(stack, lights);
        FAIL();
    } catch (const InputError& error) {
        EXPECT_NE(std::string(error.what()).find("light2"), std::string::npos);
    }
}

TEST(PhotometricStereo, OneLightForEachPhotograph) {
    Lights lights = ring(5);
    const PhotoStack stack = lambert_sphere(lights);
    lights.pop_back();
    EXPECT_THROW(photometric_stereo(stack, lights), InputError);
}

TEST(PhotometricStereo, IntensityMustBePositive) {
    Lights lights = ring(5);
    const PhotoStack stack = lambert_sphere(lights);
    lights[1].intensity[2] = 0;
    EXPECT_THROW(photometric_stereo(stack, lights), InputError);
}

TEST(PhotometricStereo, CancelledWorkThrows) {
    const Lights lights = ring(5);
    std::stop_source source;
    source.request_stop();
    WorkContext work;
    work.stop = source.get_token();
    EXPECT_THROW(photometric_stereo(lambert_sphere(lights), lights, {}, work), Cancelled);
}

TEST(PhotometricStereoOptions, NegativeMinimumIsNamed) {
    PhotometricStereoOptions options;
    options.min_albedo = -1;
    EXPECT_THROW(options.validate(), InputError);
}

}  // namespace
}  // namespace darkbox
