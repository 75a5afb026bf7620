#include <gtest/gtest.h>

#include <cmath>

#include "processing/pipeline/held_out.h"
#include "tests/processing/normals/lit_sphere.h"
#include "tests/support/simulated_stack.h"

// Which predictor comes closest on scenes that Lambert's law does not explain.

namespace darkbox {
namespace {

/// Mean over every light, all pixels.
struct Means {
    double thesis, detail, lambert, ptm;
};

Means mean_errors_of(const PhotoStack& stack, const Lights& lights) {
    const auto held_out = leave_one_light_out(stack, lights, photometric_stereo(stack, lights), every_predictor());
    const auto mean = [&](std::size_t predictor) {
        return mean_errors(held_out, predictor, LightGroup::every).errors[0].value().rmse_relative;
    };
    return {mean(0), mean(1), mean(2), mean(3)};
}

TEST(HeldOutScenes, DetailPredictsAPhongSphereBetterThanLambertAndPtm) {
    const auto phong = [](const Eigen::Vector3d& n, const Eigen::Vector3d& l, const Eigen::Vector3d& v) {
        const double n_dot_l = std::max(0.0, n.dot(l));
        const double r_dot_v = std::max(0.0, (2 * n_dot_l * n - l).dot(v));
        return 0.5 * n_dot_l + 0.25 * std::pow(r_dot_v, 30);
    };
    test::LitSphere sphere(test::spiral_lights(12), phong, 64);
    sphere.add_noise({.read_sigma = 1e-3}, 7);
    const Means errors = mean_errors_of(sphere.stack, sphere.lights);
    EXPECT_LT(errors.detail, 0.95 * errors.lambert);
    EXPECT_LT(errors.detail, 0.95 * errors.ptm);
}

TEST(HeldOutScenes, DetailPredictsABrickTorusThatShadowsItselfBest) {
    const test::SimulatedStack torus = test::simulated_stack("brick-torus", 12, 112);
    const Means errors = mean_errors_of(torus.stack, torus.lights);
    EXPECT_LT(errors.detail, errors.thesis);
    EXPECT_LT(errors.detail, errors.lambert);
    EXPECT_LT(errors.detail, errors.ptm);
}

}  // namespace
}  // namespace darkbox
