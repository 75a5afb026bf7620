// The object's own diffuse pixels as witnesses of the lights: exact Lambert objects, then noise, then a lamp that moved
// between the captures of ball and object.

#include "processing/calibration/photometric.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "processing/calibration/lambert_cost.h"
#include "processing/calibration/refine.h"
#include "processing/calibration/reflect.h"
#include "tests/processing/calibration/ball_scene.h"
#include "tests/processing/calibration/sweep.h"

namespace darkbox {
namespace {

using Eigen::Vector3d;
using test::NormalNumbers;

constexpr int frames = 12;
constexpr int side = 16;  // of the object, pixels

/// A bumpy object of uneven albedo, its attached shadows included, under lamps of uneven intensity.
struct Scene {
    ViewGeometry view{0.3, {330.2, 240.7}};
    MirrorSphere ball{{-40.3, -12.1, 0}, 18};
    std::vector<Vector3d> lamps = test::dome_of_lights(frames);  ///< as the object is lit
    std::vector<Vector3d> lamps_at_ball = test::dome_of_lights(frames);
};

ObjectPixels lit_object(const Scene& scene, double sigma, NormalNumbers& noise) {
    ObjectPixels pixels;
    pixels.radiance.resize(side * side, frames);
    for (int i = 0; i < side * side; ++i) {
        const double u = i % side, v = static_cast<double>(i / side);
        pixels.at.emplace_back(10 * u, 10 * v);
        const Vector3d normal =
            Vector3d(0.7 * std::sin(0.5 * u + 0.2 * v), 0.7 * std::cos(0.6 * v - 0.1 * u), 1).normalized();
        const double albedo = 0.5 + 0.3 * std::sin(u * v);
        for (int f = 0; f < frames; ++f) {
            const double shading = std::max(0.0, normal.dot(scene.lamps[static_cast<std::size_t>(f)]));
            pixels.radiance(i, f) = (0.7 + 0.05 * f) * albedo * shading + sigma * albedo * noise.next();
        }
    }
    pixels.radiance = pixels.radiance.cwiseMax(0.0);
    return pixels;
}

RefineInput observed(const Scene& scene, double highlight_sigma_px, NormalNumbers& noise) {
    RefineInput input;
    input.view = scene.view;
    BallObservations ball;
    ball.sphere = scene.ball;
    ball.depth_sigma_mm = 1e-3;
    for (int i = 0; i < 120; ++i) {
        const double angle = 2 * std::numbers::pi * i / 120, radius = scene.ball.radius_mm + 0.015 * noise.next();
        ball.contour.push_back(
            scene.view.project(scene.ball.centre_mm + radius * Vector3d(std::cos(angle), std::sin(angle), 0)));
    }
    for (const Vector3d& lamp : scene.lamps_at_ball) {
        const cv::Point2d at = highlight_of(scene.view, scene.ball, lamp).value();
        const double du = highlight_sigma_px * noise.next(), dv = highlight_sigma_px * noise.next();
        ball.highlights.push_back(Highlight{at.x + du, at.y + dv, highlight_sigma_px, false});
        input.start.push_back(reflect_at(scene.view, ball.sphere, {at.x + du, at.y + dv}).value().direction);
    }
    input.balls.push_back(std::move(ball));
    input.distance_known.assign(frames, false);
    return input;
}

/// Largest difference between the Jacobian and central differences, relative to its largest entry.
double jacobian_difference(const LambertCost& cost, std::vector<std::vector<double>> blocks) {
    const auto n = static_cast<std::size_t>(cost.num_residuals());
    std::vector<std::vector<double>> jacobian;
    std::vector<double*> into;
    for (const auto& block : blocks) jacobian.emplace_back(n * block.size());
    for (auto& block : jacobian) into.push_back(block.data());
    const auto evaluated = [&](double** jacobians) {
        std::vector<const double*> at;
        for (const auto& block : blocks) at.push_back(block.data());
        std::vector<double> residuals(n);
        EXPECT_TRUE(cost.Evaluate(at.data(), residuals.data(), jacobians));
        return residuals;
    };
    evaluated(into.data());
    double worst = 0, largest = 0;
    for (std::size_t b = 0; b < blocks.size(); ++b)
        for (std::size_t i = 0; i < blocks[b].size(); ++i) {
            const double middle = blocks[b][i], step = 1e-5 * std::max(1.0, std::abs(middle));
            blocks[b][i] = middle + step;
            const auto after = evaluated(nullptr);
            blocks[b][i] = middle - step;
            const auto before = evaluated(nullptr);
            blocks[b][i] = middle;
            for (std::size_t r = 0; r < n; ++r) {
                const double exact = jacobian[b][r * blocks[b].size() + i];
                worst = std::max(worst, std::abs(exact - (after[r] - before[r]) / (2 * step)));
                largest = std::max(largest, std::abs(exact));
            }
        }
    EXPECT_GT(largest, 0);
    return worst / largest;
}

TEST(LambertCost, ItsJacobianAgreesWithDifferences) {
    const Eigen::VectorXd samples = (Eigen::VectorXd(5) << 0.9, 0.4, 0.7, 0.55, 0.8).finished();
    std::vector<std::vector<double>> blocks;
    const auto lamps = test::dome_of_lights(5);
    for (const Vector3d& d : lamps) blocks.push_back({d[0], d[1], d[2]});
    for (int k = 0; k < 5; ++k) blocks.push_back({0.1 * k - 0.2});
    EXPECT_LT(jacobian_difference(LambertCost(samples, 0.02, {}), blocks), 1e-7);
    for (std::size_t k = 0; k < 5; ++k)
        for (double& x : blocks[k]) x *= 700;
    EXPECT_LT(jacobian_difference(LambertCost(samples, 0.02, {true, {30, -20, 5}, 700}), blocks), 1e-6);
}

TEST(LambertSamples, OfAnExactObjectLeaveNothingButShadowsOut) {
    NormalNumbers noise(1);
    const Scene scene;
    const ObjectPixels pixels = lit_object(scene, 0, noise);
    std::vector<Vector3d> off = scene.lamps;  // no light need be right
    for (Vector3d& lamp : off) lamp = (lamp + 0.05 * Vector3d(noise.next(), noise.next(), noise.next())).normalized();
    const LambertSamples samples = lambert_samples(pixels, off);
    ASSERT_FALSE(samples.empty());
    EXPECT_LT(samples.sigma, 1e-3);
    EXPECT_GT(samples.kept.sum(), 0.8 * static_cast<double>(pixels.radiance.size()));
    for (Eigen::Index p = 0; p < samples.kept.rows(); ++p)
        for (Eigen::Index f = 0; f < frames; ++f) EXPECT_TRUE(samples.kept(p, f) == 0 || samples.radiance(p, f) > 0);
}

TEST(LambertSamples, AreNoneWhereNothingFollowsTheLaw) {
    NormalNumbers noise(1);
    ObjectPixels pixels = lit_object(Scene(), 0, noise);
    pixels.radiance.setConstant(-1);
    EXPECT_TRUE(lambert_samples(pixels, Scene().lamps).empty());
}

struct Compared {
    std::vector<double> alone_deg, with_object_deg, chi_squared;
};

Compared compared(double pixel_sigma, int trials) {
    Compared result;
    for (int trial = 0; trial < trials; ++trial) {
        NormalNumbers noise(static_cast<std::uint64_t>(trial) + 1);
        const Scene scene;
        RefineInput input = observed(scene, 0.5, noise);
        const RefineResult alone = refine(input);
        input.object = lambert_samples(lit_object(scene, pixel_sigma, noise), input.start);
        EXPECT_FALSE(input.object.empty());
        const RefineResult joint = refine(input);
        for (std::size_t i = 0; i < frames; ++i) {
            result.alone_deg.push_back(angle_deg(alone.lights[i]->direction, scene.lamps[i]));
            result.with_object_deg.push_back(angle_deg(joint.lights[i]->direction, scene.lamps[i]));
            Light light;
            light.direction = joint.lights[i]->direction;
            light.covariance = joint.lights[i]->covariance;
            result.chi_squared.push_back(test::chi_squared(light, scene.lamps[i]));
        }
    }
    for (auto* values : {&result.alone_deg, &result.with_object_deg, &result.chi_squared})
        std::sort(values->begin(), values->end());
    return result;
}

double share_below(const std::vector<double>& sorted, double probability) {
    const auto below = std::lower_bound(sorted.begin(), sorted.end(), -2 * std::log(1 - probability));
    return static_cast<double>(below - sorted.begin()) / static_cast<double>(sorted.size());
}

TEST(Photometric, AnObjectWithoutNoiseImprovesLights) {
    const Compared result = compared(0, 4);
    const std::size_t middle = result.chi_squared.size() / 2;
    EXPECT_LT(result.with_object_deg[middle], 0.8 * result.alone_deg[middle]);
}

TEST(Photometric, ANoisyObjectImprovesLightsAndTheCovariancesAreHonest) {
    const Compared result = compared(0.02, 40);
    const std::size_t middle = result.chi_squared.size() / 2;
    fmt::print("median {:.3f} degrees by the ball, {:.3f} with the object; {:.1f}, {:.1f}, {:.1f} %\n",
               result.alone_deg[middle], result.with_object_deg[middle], 100 * share_below(result.chi_squared, 0.5),
               100 * share_below(result.chi_squared, 0.9), 100 * share_below(result.chi_squared, 0.95));
    EXPECT_LT(result.with_object_deg[middle], 0.8 * result.alone_deg[middle]);
    EXPECT_NEAR(share_below(result.chi_squared, 0.5), 0.50, 0.05);
    EXPECT_NEAR(share_below(result.chi_squared, 0.9), 0.90, 0.05);
    EXPECT_NEAR(share_below(result.chi_squared, 0.95), 0.95, 0.05);
}

TEST(Photometric, ALampThatMovedBetweenTheCapturesIsSeenByTheObject) {
    NormalNumbers noise(5);
    Scene scene;
    scene.lamps[2] = (scene.lamps[2] + 0.105 * scene.lamps[2].unitOrthogonal()).normalized();  // 6 degrees
    RefineInput input = observed(scene, 0.1, noise);
    input.object = lambert_samples(lit_object(scene, 0.01, noise), input.start);
    const RefineResult result = refine(input);
    ASSERT_THAT(result.rejected, testing::SizeIs(1));
    EXPECT_EQ(result.rejected[0].frame, 2U);
    EXPECT_LT(angle_deg(result.lights[2]->direction, scene.lamps[2]), 0.5);
    for (std::size_t i = 0; i < frames; ++i)
        EXPECT_LT(angle_deg(result.lights[i]->direction, scene.lamps[i]), 0.5) << i;
}

}  // namespace
}  // namespace darkbox
