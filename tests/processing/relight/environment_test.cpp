#include <gmock/gmock.h>

#include <cmath>
#include <limits>
#include <numbers>

#include "acquisition/frame/error.h"
#include "processing/relight/relight.h"
#include "tests/processing/relight/sphere_scene.h"

namespace darkbox {
namespace {

using test::sphere_scene;

constexpr double pi = std::numbers::pi;

Environment uniform(cv::Size size, float radiance) { return {cv::Mat3f(size, cv::Vec3f::all(radiance))}; }

/// Black but for one pixel, which lights like a lamp of intensity 1.
Environment single(cv::Size size, int row, int column) {
    Environment probe = uniform(size, 0);
    const double step = pi / size.height;
    const double solid_angle = 2 * pi / size.width * (std::cos(row * step) - std::cos((row + 1) * step));
    probe.radiance(row, column) = cv::Vec3f::all(static_cast<float>(pi / solid_angle));
    return probe;
}

/// Written out from the convention in relight.h.
Light light_of(cv::Size size, int row, int column) {
    const double polar = pi * (row + 0.5) / size.height;
    const double turn = 2 * pi * ((column + 0.5) / size.width - 0.5);
    return test::light_from(std::sin(polar) * std::sin(turn), std::cos(polar), -std::sin(polar) * std::cos(turn));
}

cv::Point2d centroid(const cv::Mat3f& image) {
    const cv::Mat1f grey = mean_channel(image);
    cv::Point2d sum(0, 0);
    for (int y = 0; y < grey.rows; ++y)
        for (int x = 0; x < grey.cols; ++x) sum += cv::Point2d(x, y) * static_cast<double>(grey(y, x));
    return sum * (1 / cv::sum(grey)[0]);
}

TEST(Environment, UniformProbeShowsLambertInItsAlbedo) {
    const RelightScene scene = sphere_scene(101);
    for (const cv::Size size : {cv::Size(256, 128), cv::Size(100, 50)}) {
        const cv::Mat3f image = relight(scene, uniform(size, 1)).image;
        EXPECT_LT(test::relative_rms(image, scene.albedo.albedo), 0.002);
        EXPECT_LT(test::largest_difference(image, scene.albedo.albedo), 0.004);
    }
}

TEST(Environment, ASinglePixelIsALamp) {
    const RelightScene scene = sphere_scene(101);
    const cv::Size size(256, 128);
    for (const cv::Point pixel : {cv::Point(40, 50), cv::Point(201, 30), cv::Point(10, 90)}) {
        const cv::Mat3f lamp = relight(scene, {light_of(size, pixel.y, pixel.x)}).image;
        const cv::Mat3f probe = relight(scene, single(size, pixel.y, pixel.x)).image;
        EXPECT_LT(test::relative_rms(probe, lamp), 0.003);
    }
}

TEST(Environment, ASinglePixelIsALampUnderPhongToo) {
    const RelightScene scene = sphere_scene(101);
    RelightOptions phong;
    phong.model = ReflectanceModel::phong;
    const cv::Size size(256, 128);
    const cv::Mat3f lamp = relight(scene, {light_of(size, 50, 230)}, phong).image;
    EXPECT_LT(test::relative_rms(relight(scene, single(size, 50, 230), phong).image, lamp), 0.01);
}

TEST(Environment, StandsAsDocumented) {
    const RelightScene scene = sphere_scene(101);
    const cv::Size size(64, 32);
    EXPECT_LT(centroid(relight(scene, single(size, 0, 5)).image).y, 40);    // row 0 is up
    EXPECT_GT(centroid(relight(scene, single(size, 31, 5)).image).y, 60);   // the last row is down
    EXPECT_GT(centroid(relight(scene, single(size, 16, 48)).image).x, 60);  // right of the middle is right
    EXPECT_LT(centroid(relight(scene, single(size, 16, 16)).image).x, 40);
    EXPECT_GT(relight(scene, single(size, 16, 0)).image(50, 50)[0], 0.1F);   // the seam is at the camera
    EXPECT_EQ(relight(scene, single(size, 16, 32)).image(50, 50)[0], 0.0F);  // the middle is behind the object
}

TEST(Environment, YawTurnsWhatIsBehindToTheLeft) {
    const RelightScene scene = sphere_scene(101);
    RelightOptions quarter;
    quarter.environment_yaw = pi / 2;
    const cv::Mat3f turned = relight(scene, single({64, 32}, 16, 32), quarter).image;
    EXPECT_LT(centroid(turned).x, 40);
    const cv::Mat3f elsewhere = relight(scene, single({64, 32}, 16, 16)).image;
    EXPECT_LT(test::largest_difference(turned, elsewhere), 1e-5);
}

TEST(Environment, ProbesAddUpAndScale) {
    const RelightScene scene = sphere_scene(61);
    Environment both = single({64, 32}, 10, 3);
    both.radiance += 2 * single({64, 32}, 8, 50).radiance;
    const cv::Mat sum =
        relight(scene, single({64, 32}, 10, 3)).image + 2 * relight(scene, single({64, 32}, 8, 50)).image;
    EXPECT_LT(test::largest_difference(relight(scene, both).image, sum), 1e-5);
}

TEST(Environment, TinyAndBlackProbesAreFine) {
    const RelightScene scene = sphere_scene(61);
    EXPECT_EQ(cv::norm(relight(scene, uniform({16, 8}, 0)).image, cv::NORM_INF), 0);
    EXPECT_GT(cv::norm(relight(scene, uniform({1, 1}, 1)).image, cv::NORM_INF), 0);
}

TEST(Environment, SameBitsOnAnyNumberOfThreads) {
    const RelightScene scene = sphere_scene(90);
    Environment probe = uniform({200, 100}, 0);
    cv::theRNG().state = 9;
    cv::randu(probe.radiance, cv::Scalar::all(0), cv::Scalar::all(3));
    WorkContext work;
    work.threads = 1;
    const cv::Mat3f one = relight(scene, probe, {}, work).image;
    for (const int threads : {2, 8}) {
        work.threads = threads;
        EXPECT_EQ(test::largest_difference(one, relight(scene, probe, {}, work).image), 0);
    }
}

TEST(Environment, RefusesProbesThatCannotBe) {
    const RelightScene scene = sphere_scene(31);
    EXPECT_THROW(relight(scene, Environment{}), InputError);
    for (const float bad : {-0.1F, std::nanf(""), std::numeric_limits<float>::infinity()}) {
        Environment probe = uniform({16, 8}, 1);
        probe.radiance(3, 3)[2] = bad;
        EXPECT_THROW(relight(scene, probe), InputError);
    }
}

}  // namespace
}  // namespace darkbox
