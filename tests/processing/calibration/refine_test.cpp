#include "processing/calibration/refine.h"

#include <ceres/ceres.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <numbers>

#include "processing/calibration/reflect.h"
#include "tests/processing/calibration/ball_scene.h"

namespace darkbox {
namespace {

using test::NormalNumbers;

const Circle true_circle{120.4, 90.7, 60.0};
const Ball true_ball{120.4, 90.7, 60.0, 1.0};

/// Contour and highlights as measured with the given standard deviations.
RefineInput measured(const std::vector<Eigen::Vector3d>& lights, double contour_sigma, double highlight_sigma,
                     std::uint64_t seed) {
    NormalNumbers noise(seed);
    RefineInput input;
    input.circle = {true_circle.x + 0.8, true_circle.y - 0.6, true_circle.radius + 0.7};
    input.contour_sigma_px = std::max(contour_sigma, 0.05);
    for (int i = 0; i < 120; ++i) {
        const double angle = 2 * std::numbers::pi * i / 120, radius = true_circle.radius + contour_sigma * noise.next();
        input.contour.emplace_back(true_circle.x + radius * std::cos(angle), true_circle.y + radius * std::sin(angle));
    }
    for (const auto& light : lights) {
        const auto at = highlight_of(true_ball, light).value();
        const double du = highlight_sigma * noise.next(), dv = highlight_sigma * noise.next();
        input.highlights.push_back(Highlight{at.x + du, at.y + dv, std::max(highlight_sigma, 0.05), false});
    }
    return input;
}

/// Largest difference between automatic and central-difference derivatives.
template <class Functor, int residuals, int... sizes>
double jacobian_difference(const Functor& functor, std::vector<std::array<double, 3>> blocks) {
    ceres::AutoDiffCostFunction<Functor, residuals, sizes...> automatic(new Functor(functor));
    ceres::NumericDiffCostFunction<Functor, ceres::CENTRAL, residuals, sizes...> numeric(new Functor(functor));
    std::vector<const double*> parameters;
    for (const auto& block : blocks) parameters.push_back(block.data());
    std::array<double, residuals> value{};
    std::vector<std::array<double, 3 * residuals>> a(blocks.size()), b(blocks.size());
    std::vector<double*> pa, pb;
    for (std::size_t i = 0; i < blocks.size(); ++i) {
        pa.push_back(a[i].data());
        pb.push_back(b[i].data());
    }
    EXPECT_TRUE(automatic.Evaluate(parameters.data(), value.data(), pa.data()));
    EXPECT_TRUE(numeric.Evaluate(parameters.data(), value.data(), pb.data()));
    double worst = 0;
    for (std::size_t i = 0; i < blocks.size(); ++i)
        for (std::size_t k = 0; k < a[i].size(); ++k) worst = std::max(worst, std::abs(a[i][k] - b[i][k]));
    return worst;
}

TEST(RefineJacobians, AgreeWithNumericOnes) {
    const std::array<double, 3> circle{120, 90, 60}, light{0.36, -0.48, 0.8};
    EXPECT_LT((jacobian_difference<ContourResidual, 1, 3>({150, 40, 0.3}, {circle})), 1e-6);
    EXPECT_LT((jacobian_difference<HighlightResidual, 2, 3, 3>({130, 99, 0.3}, {circle, light})), 1e-4);
}

TEST(Refine, ExactMeasurementsGiveExactDirections) {
    const auto lights = test::dome_of_lights(12);
    const RefineResult result = refine(measured(lights, 0, 0, 1));
    ASSERT_TRUE(result.converged);
    EXPECT_NEAR(result.circle.x, true_circle.x, 1e-3);
    EXPECT_NEAR(result.circle.y, true_circle.y, 1e-3);
    EXPECT_NEAR(result.circle.radius, true_circle.radius, 1e-3);
    for (std::size_t i = 0; i < lights.size(); ++i) EXPECT_LT(angle_deg(result.lights[i]->direction, lights[i]), 0.05);
}

TEST(Refine, StrayContourPointsDoNotPull) {
    const auto lights = test::dome_of_lights(8);
    RefineInput input = measured(lights, 0.05, 0.02, 2);
    for (std::size_t i = 0; i < 15; ++i) input.contour[i] += cv::Point2d(4, 3);
    const RefineResult result = refine(input);
    EXPECT_NEAR(result.circle.x, true_circle.x, 0.05);
    EXPECT_NEAR(result.circle.y, true_circle.y, 0.05);
}

TEST(Refine, SigmaIsHonest) {
    const auto lights = test::dome_of_lights(12);
    int inside_half = 0, inside_95 = 0, total = 0;
    for (std::uint64_t seed = 1; seed <= 40; ++seed) {
        const RefineResult result = refine(measured(lights, 0.2, 0.1, 1000 * seed));
        for (std::size_t i = 0; i < lights.size(); ++i) {
            const Light light{"", result.lights[i]->direction, {1, 1, 1}, true, result.lights[i]->covariance};
            const double error = angle_deg(light.direction, lights[i]) / light.sigma_deg();
            inside_half += error * error < 1.386;  // chi-squared with two degrees of freedom: 50 %
            inside_95 += error * error < 5.991;    // 95 %
            ++total;
        }
    }
    EXPECT_NEAR(inside_half / static_cast<double>(total), 0.50, 0.10);
    EXPECT_NEAR(inside_95 / static_cast<double>(total), 0.95, 0.05);
}

TEST(Refine, FrameWithoutHighlightHasNoLight) {
    RefineInput input = measured(test::dome_of_lights(5), 0, 0, 3);
    input.highlights[2].reset();
    const RefineResult result = refine(input);
    EXPECT_FALSE(result.lights[2]);
    EXPECT_TRUE(result.lights[3]);
}

}  // namespace
}  // namespace darkbox
