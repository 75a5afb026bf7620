#include "processing/calibration/light_geometry.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <numbers>
#include <random>

#include "processing/calibration/normal_error.h"
#include "tests/processing/calibration/drift_scene.h"

namespace darkbox {
namespace {

using testing::HasSubstr;

constexpr double degrees = 180 / std::numbers::pi;

Lights ring(int count, double slant_deg) {
    Lights lights(static_cast<std::size_t>(count));
    for (int i = 0; i < count; ++i) {
        const double turn = 2 * std::numbers::pi * i / count, slant = slant_deg / degrees;
        lights[static_cast<std::size_t>(i)].direction = {std::sin(slant) * std::cos(turn),
                                                         std::sin(slant) * std::sin(turn), std::cos(slant)};
    }
    return lights;
}

TEST(NormalError, OfAnOrthogonalTriadIsTheSameForEveryNormal) {
    for (const Eigen::Vector3d& normal : visible_normals(50))
        EXPECT_NEAR(normal_error_deg(Eigen::Matrix3d::Identity(), normal, 0.01), 0.01 * std::sqrt(2.0) * degrees, 1e-4);
}

TEST(NormalError, OfNoLightIsAboutARadianAndNotInfinite) {
    EXPECT_NEAR(normal_error_deg(Eigen::Matrix3d::Zero(), {0, 0, 1}, 0.01), std::sqrt(2.0) * degrees, 1e-9);
}

TEST(LightGeometry, ATriadLightsAQuarterOfTheVisibleNormals) {
    const LightGeometry geometry = light_geometry(ring(3, 54.7356));
    EXPECT_NEAR(geometry.condition_number, 1, 1e-4);
    EXPECT_NEAR(geometry.noise_error_deg.value(), 0.01 * std::sqrt(2.0) * degrees, 1e-3);
    EXPECT_NEAR(geometry.undetermined_share, 0.75, 0.005);
    EXPECT_FALSE(geometry.direction_error_deg);
}

TEST(LightGeometry, ErrorFallsWithTheRootOfTheNumberOfLights) {
    EXPECT_NEAR(
        light_geometry(ring(12, 45)).noise_error_deg.value() / light_geometry(ring(48, 45)).noise_error_deg.value(), 2,
        0.06);
}

TEST(LightGeometry, CoplanarLightsDetermineNothing) {
    Lights lights = ring(6, 45);
    for (Light& light : lights) light.direction.y() = 0, light.direction.normalize();
    const LightGeometry geometry = light_geometry(lights);
    EXPECT_TRUE(std::isinf(geometry.condition_number));
    EXPECT_FALSE(geometry.noise_error_deg);
    EXPECT_EQ(geometry.undetermined_share, 1);
    EXPECT_THAT(in_words(geometry), HasSubstr("no normal"));
}

TEST(LightGeometry, LightsThatAreNotUsedDoNotCount) {
    Lights lights = ring(6, 45);
    const double error = light_geometry(lights).noise_error_deg.value();
    Light aside;
    aside.direction = Eigen::Vector3d(3, 1, 1).normalized();
    aside.used = false;
    lights.push_back(aside);
    EXPECT_EQ(light_geometry(lights).noise_error_deg.value(), error);
}

/// What least squares over the lit lights really does under noise, against what is predicted.
TEST(LightGeometry, PredictionsAgreeWithLeastSquaresUnderNoise) {
    Lights lights = test::dome(10, 0.5).lights;
    const LightGeometry predicted = light_geometry(lights);
    std::mt19937 random(5);
    std::normal_distribution<double> normal;
    double noise_sum = 0, direction_sum = 0;
    int counted = 0;
    for (const Eigen::Vector3d& n : visible_normals(400)) {
        Eigen::Matrix3d information = Eigen::Matrix3d::Zero();
        for (const Light& light : lights)
            if (n.dot(light.direction) > 0) information += light.direction * light.direction.transpose();
        if (!determines_normals(information)) continue;
        double noise_squared = 0, direction_squared = 0;
        constexpr int trials = 200;
        for (int trial = 0; trial < trials; ++trial) {
            Eigen::Vector3d noisy = Eigen::Vector3d::Zero(), misled = Eigen::Vector3d::Zero();
            for (const Light& light : lights) {
                const double radiance = n.dot(light.direction);
                if (radiance <= 0) continue;
                noisy += light.direction * (radiance + 0.01 * normal(random));
                const Eigen::Vector3d u = light.direction.unitOrthogonal(), v = light.direction.cross(u);
                const double sigma = light.sigma_deg() / degrees;
                const Eigen::Vector3d truth = light.direction + sigma * (normal(random) * u + normal(random) * v);
                misled += light.direction * n.dot(truth);
            }
            const double a = angle_deg(information.inverse() * noisy, n),
                         b = angle_deg(information.inverse() * misled, n);
            noise_squared += a * a;
            direction_squared += b * b;
        }
        noise_sum += std::sqrt(noise_squared / trials);
        direction_sum += std::sqrt(direction_squared / trials);
        ++counted;
    }
    EXPECT_NEAR(noise_sum / counted / predicted.noise_error_deg.value(), 1, 0.03);
    EXPECT_NEAR(direction_sum / counted / predicted.direction_error_deg.value(), 1, 0.03);
}

}  // namespace
}  // namespace darkbox
