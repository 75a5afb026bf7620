#include "processing/calibration/refine.h"

#include <ceres/ceres.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <numbers>

#include "processing/calibration/reflect.h"
#include "processing/calibration/residuals.h"
#include "tests/processing/calibration/ball_scene.h"
#include "tests/processing/calibration/sweep.h"

namespace darkbox {
namespace {

using test::NormalNumbers;

const double infinite = std::numeric_limits<double>::infinity();

/// Two balls before a camera, and where lamps stand; distant ones shine along their places.
struct Truth {
    ViewGeometry view{0.3, {330.2, 240.7}, infinite};
    std::vector<MirrorSphere> balls{{{-40.3, -12.1, 0}, 18}};
    LampModel lamps = LampModel::distant;
    Eigen::Vector3d object{10, 5, 0};

    cv::Point2d highlight(std::size_t ball, const Eigen::Vector3d& lamp) const {
        return lamps == LampModel::near ? highlight_of_lamp(view, balls[ball], lamp).value()
                                        : highlight_of(view, balls[ball], lamp).value();
    }
    Eigen::Vector3d direction(const Eigen::Vector3d& lamp) const {
        return lamps == LampModel::near ? Eigen::Vector3d((lamp - object).normalized())
                                        : Eigen::Vector3d(lamp.normalized());
    }
};

std::vector<Eigen::Vector3d> lamps_of(const Truth& truth, int n) {
    std::vector<Eigen::Vector3d> lamps = test::dome_of_lights(n);
    if (truth.lamps == LampModel::near)
        for (Eigen::Vector3d& lamp : lamps) lamp *= 900;
    return lamps;
}

/// Points of a sphere's limb as the camera sees it: where normals are square to the view.
std::vector<cv::Point2d> limb(const ViewGeometry& view, const MirrorSphere& sphere, int n) {
    std::vector<cv::Point2d> points;
    const Eigen::Vector3d axis = view.to_camera(sphere.centre_mm);
    const double distance = (Eigen::Vector3d(0, 0, view.distance_mm) - sphere.centre_mm).norm();
    const double lift = view.perspective() ? sphere.radius_mm / distance : 0;  // the limb circle's height, in radii
    const Eigen::Vector3d a = axis.unitOrthogonal(), b = axis.cross(a);
    for (int i = 0; i < n; ++i) {
        const double angle = 2 * std::numbers::pi * i / n;
        const Eigen::Vector3d normal =
            lift * axis + std::sqrt(1 - lift * lift) * (std::cos(angle) * a + std::sin(angle) * b);
        points.push_back(view.project(sphere.centre_mm + sphere.radius_mm * normal));
    }
    return points;
}

/// Contour and highlights as measured with the given standard deviations; the start is off.
RefineInput measured(const Truth& truth, const std::vector<Eigen::Vector3d>& lamps, double contour_sigma,
                     double highlight_sigma, std::uint64_t seed) {
    NormalNumbers noise(seed);
    RefineInput input;
    input.view = truth.view;
    input.lamps = truth.lamps;
    input.object_mm = truth.object;
    for (std::size_t b = 0; b < truth.balls.size(); ++b) {
        BallObservations ball;
        ball.sphere = truth.balls[b];
        ball.sphere.centre_mm += Eigen::Vector3d(0.3, -0.2, truth.view.perspective() ? 4 : 0);
        if (truth.view.perspective())
            ball.radius_sigma_mm = 1e-3;
        else
            ball.depth_sigma_mm = 1e-3, ball.sphere.radius_mm += 0.2;
        const Ball outline = outline_of(truth.view, truth.balls[b]);
        for (const cv::Point2d& p : limb(truth.view, truth.balls[b], 120)) {
            const cv::Point2d out = (p - cv::Point2d(outline.x, outline.y)) / outline.radius;
            ball.contour.push_back(p + contour_sigma * noise.next() * out);
        }
        for (const auto& lamp : lamps) {
            const auto at = truth.highlight(b, lamp);
            const double du = highlight_sigma * noise.next(), dv = highlight_sigma * noise.next();
            ball.highlights.push_back(Highlight{at.x + du, at.y + dv, std::max(highlight_sigma, 0.01), false});
        }
        input.balls.push_back(std::move(ball));
    }
    for (const auto& lamp : lamps) {
        const Eigen::Vector3d off = 0.02 * lamp.norm() * Eigen::Vector3d(1, -1, 0.5);
        input.start.push_back(truth.lamps == LampModel::near ? Eigen::Vector3d(lamp + off)
                                                             : Eigen::Vector3d((lamp + off).normalized()));
    }
    input.distance_known.assign(lamps.size(), truth.balls.size() > 1);
    return input;
}

Truth perspective(Truth truth) {
    truth.view.distance_mm = 800;
    return truth;
}
Truth near_two_balls() {
    Truth truth;
    truth.lamps = LampModel::near;
    truth.balls.push_back({{70.2, 20.4, 0}, 18});
    return truth;
}

/// Largest difference between automatic and central-difference derivatives, relative to the largest derivative.
template <class Functor, int residuals, int... sizes>
double jacobian_difference(const Functor& functor, const std::vector<std::vector<double>>& blocks) {
    ceres::AutoDiffCostFunction<Functor, residuals, sizes...> automatic(new Functor(functor));
    ceres::NumericDiffCostFunction<Functor, ceres::RIDDERS, residuals, sizes...> numeric(new Functor(functor));
    std::vector<const double*> parameters;
    for (const auto& block : blocks) parameters.push_back(block.data());
    std::array<double, residuals> value{};
    std::vector<std::array<double, 4 * residuals>> a(blocks.size()), b(blocks.size());
    std::vector<double*> pa, pb;
    for (std::size_t i = 0; i < blocks.size(); ++i) {
        pa.push_back(a[i].data());
        pb.push_back(b[i].data());
    }
    EXPECT_TRUE(automatic.Evaluate(parameters.data(), value.data(), pa.data()));
    EXPECT_TRUE(numeric.Evaluate(parameters.data(), value.data(), pb.data()));
    double worst = 0, largest = 0;
    for (std::size_t i = 0; i < blocks.size(); ++i)
        for (std::size_t k = 0; k < residuals * blocks[i].size(); ++k) {
            worst = std::max(worst, std::abs(a[i][k] - b[i][k]));
            largest = std::max(largest, std::abs(a[i][k]));
        }
    EXPECT_GT(largest, 0);
    return worst / largest;
}

TEST(RefineJacobians, AgreeWithNumericOnes) {
    const std::vector<double> sphere{-41, -12, 3, 18}, direction{0.36, -0.48, 0.8}, place{320, -410, 760};
    for (const double distance : {infinite, 800.0}) {
        const ViewGeometry view{0.3, {330, 240}, distance};
        const Viewing viewing(view);
        EXPECT_LT((jacobian_difference<ContourResidual, 1, 4>(ContourResidual(view, {190, 300}, 0.3), {sphere})), 1e-7);
        HighlightResidual highlight{viewing, 200, 290, 0.3};
        EXPECT_LT((jacobian_difference<HighlightResidual, 2, 4, 3>(highlight, {sphere, direction})), 1e-7);
        highlight.near = true;
        EXPECT_LT((jacobian_difference<HighlightResidual, 2, 4, 3>(highlight, {sphere, place})), 1e-7);
        EXPECT_LT((jacobian_difference<OutlinePrior, 3, 4>(OutlinePrior{viewing, 195, 281, 59, 0.5}, {sphere})), 1e-7);
    }
    EXPECT_LT((jacobian_difference<SpherePrior, 2, 4>(SpherePrior{1, 2, 18, 0.1}, {sphere})), 1e-7);
    const std::vector<double> turn{0.02, -0.05, 0.01}, shift{3, -2, 5};
    const NominalResidual nominal{{300, -400, 800}, 20, true};
    EXPECT_LT((jacobian_difference<NominalResidual, 3, 3, 3, 3>(nominal, {turn, shift, place})), 1e-7);
    const NominalResidual distant{{300, -400, 800}, 20, false};
    EXPECT_LT((jacobian_difference<NominalResidual, 3, 3, 3, 3>(distant, {{0, 0, 0}, shift, direction})), 1e-7);
    EXPECT_LT((jacobian_difference<DistancePrior, 1, 3>(DistancePrior{{1, 2, 3}, 900, 100}, {place})), 1e-7);
}

void expect_exact(const Truth& truth) {
    const auto lamps = lamps_of(truth, 12);
    const RefineResult result = refine(measured(truth, lamps, 0, 0, 1));
    ASSERT_TRUE(result.converged);
    for (std::size_t b = 0; b < truth.balls.size(); ++b) {
        EXPECT_LT((result.balls[b].sphere.centre_mm - truth.balls[b].centre_mm).norm(), 1e-3);
        EXPECT_NEAR(result.balls[b].sphere.radius_mm, truth.balls[b].radius_mm, 1e-3);
    }
    for (std::size_t i = 0; i < lamps.size(); ++i) {
        EXPECT_LT(angle_deg(result.lights[i]->direction, truth.direction(lamps[i])), 1e-3);
        if (truth.lamps == LampModel::near) {
            EXPECT_LT((result.lights[i]->near.value().position_mm - lamps[i]).norm(), 0.1);
        }
    }
}

TEST(Refine, ExactMeasurementsGiveExactLights) {
    expect_exact({});
    expect_exact(perspective({}));
    expect_exact(near_two_balls());
    expect_exact(perspective(near_two_balls()));
}

TEST(Refine, StrayContourPointsAreLeftOutAndCounted) {
    const Truth truth;
    RefineInput input = measured(truth, lamps_of(truth, 8), 0.05, 0.02, 2);
    for (std::size_t i = 0; i < 15; ++i) input.balls[0].contour[i] += cv::Point2d(4, 3);
    const RefineResult result = refine(input);
    EXPECT_LT((result.balls[0].sphere.centre_mm - truth.balls[0].centre_mm).norm(), 0.01);
    EXPECT_GE(result.balls[0].rejected_points, 13U);
    EXPECT_LE(result.balls[0].rejected_points, 17U);
    EXPECT_GT(result.balls[0].worst_rejected_px, 3);
}

TEST(Refine, AWrongHighlightAmongThreeBallsIsNamed) {
    Truth truth = near_two_balls();
    truth.balls.push_back({{20, -45, 0}, 18});
    const auto lamps = lamps_of(truth, 9);
    RefineInput input = measured(truth, lamps, 0.05, 0.03, 5);
    input.balls[1].highlights[4]->u += 6;
    const RefineResult result = refine(input);
    ASSERT_EQ(result.rejected.size(), 1U);
    EXPECT_EQ(result.rejected[0].ball, 1U);
    EXPECT_EQ(result.rejected[0].frame, 4U);
    EXPECT_LT(angle_deg(result.lights[4]->direction, truth.direction(lamps[4])), 0.3);
}

TEST(Refine, OneBallAndTheRigsGeometryTellNearLamps) {
    Truth truth;
    truth.lamps = LampModel::near;
    const auto lamps = lamps_of(truth, 12);
    RefineInput input = measured(truth, lamps, 0.05, 0.03, 3);
    const Eigen::AngleAxisd rig_from_viewer(0.03, Eigen::Vector3d(1, 2, 3).normalized());
    NormalNumbers random(4);
    input.nominal.emplace();
    input.nominal->slack_mm = 5;
    for (const auto& lamp : lamps)
        input.nominal->position_in_rig_mm.emplace_back(
            rig_from_viewer * lamp + 5 * Eigen::Vector3d(random.next(), random.next(), random.next()));
    const RefineResult result = refine(input);
    for (std::size_t i = 0; i < lamps.size(); ++i) {
        EXPECT_LT((result.lights[i]->near.value().position_mm - lamps[i]).norm(), 20);
        EXPECT_LT(angle_deg(result.lights[i]->direction, truth.direction(lamps[i])), 0.15);
    }
}

TEST(Refine, AHighlightIsBelievedAgainstTheDescriptionOfItsLamp) {
    for (const double off_mm : {150.0, 400.0, 900.0}) {
        Truth truth;
        truth.lamps = LampModel::near;
        const auto lamps = lamps_of(truth, 12);
        RefineInput input = measured(truth, lamps, 0.05, 0.03, 3);
        input.nominal.emplace();
        for (const auto& lamp : lamps) input.nominal->position_in_rig_mm.emplace_back(lamp);
        *input.nominal->position_in_rig_mm[4] += off_mm * lamps[4].unitOrthogonal();
        const RefineResult result = refine(input);
        EXPECT_TRUE(result.rejected.empty());
        ASSERT_EQ(result.misplaced.size(), 1U) << off_mm;
        EXPECT_EQ(result.misplaced[0].frame, 4U);
        ASSERT_TRUE(result.lights[4]);
        EXPECT_LT(angle_deg(result.lights[4]->direction, truth.direction(lamps[4])), 1.0) << off_mm;
        for (const std::size_t other : {0U, 3U, 7U, 11U})
            EXPECT_LT(angle_deg(result.lights[other]->direction, truth.direction(lamps[other])), 0.15);
    }
}

TEST(Refine, ASingleBallAloneLeavesTheDistanceOpenAndSaysSo) {
    Truth truth;
    truth.lamps = LampModel::near;
    const auto lamps = lamps_of(truth, 6);
    const RefineResult result = refine(measured(truth, lamps, 0.05, 0.03, 3));
    for (std::size_t i = 0; i < lamps.size(); ++i) {
        const Light light{"", result.lights[i]->direction, {1, 1, 1}, true, result.lights[i]->covariance};
        EXPECT_GT(light.sigma_deg(), 0.5);
    }
}

/// Shares of the errors' chi-squared below its 50 and 95 % points over many noisy captures.
void expect_honest(const Truth& truth) {
    const auto lamps = lamps_of(truth, 12);
    int inside_half = 0, inside_95 = 0, total = 0;
    for (std::uint64_t seed = 1; seed <= 40; ++seed) {
        const RefineResult result = refine(measured(truth, lamps, 0.2, 0.1, 1000 * seed));
        for (std::size_t i = 0; i < lamps.size(); ++i) {
            const Light light{"", result.lights[i]->direction, {1, 1, 1}, true, result.lights[i]->covariance};
            const double error = test::chi_squared(light, truth.direction(lamps[i]));
            inside_half += error < 1.386;  // chi-squared with two degrees of freedom: 50 %
            inside_95 += error < 5.991;    // 95 %
            ++total;
        }
    }
    EXPECT_NEAR(inside_half / static_cast<double>(total), 0.50, 0.06);
    EXPECT_NEAR(inside_95 / static_cast<double>(total), 0.95, 0.03);
}

TEST(Refine, CovariancesAreHonest) {
    expect_honest({});
    expect_honest(perspective({}));
    expect_honest(near_two_balls());
}

TEST(Refine, FrameWithoutHighlightHasNoLight) {
    const Truth truth;
    RefineInput input = measured(truth, lamps_of(truth, 5), 0, 0, 3);
    input.balls[0].highlights[2].reset();
    const RefineResult result = refine(input);
    EXPECT_FALSE(result.lights[2]);
    EXPECT_TRUE(result.lights[3]);
}

}  // namespace
}  // namespace darkbox
