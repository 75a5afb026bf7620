// Is the predicted standard deviation true? Errors over predictions must be distributed like Rayleigh's, the length of
// a round error in two dimensions: 50 % below 1.177, 95 % below 2.448.

#include <gtest/gtest.h>

#include <Eigen/Dense>

#include "tests/processing/normals/lit_sphere.h"

namespace darkbox {
namespace {

constexpr double median_of_rayleigh = 1.1774;

struct Case {
    Solver solver;
    int lights;
    bool noise_given;
};

/// Light directions off by a random turn, and the covariance that says so.
Lights uncertain(Lights lights, double sigma_deg, unsigned seed) {
    std::mt19937_64 bits(seed);
    std::normal_distribution<double> turn(0, sigma_deg * std::numbers::pi / 180);
    for (Light& light : lights) {
        const Eigen::Vector3d a = light.direction.unitOrthogonal(), b = light.direction.cross(a);
        light.covariance = turn.stddev() * turn.stddev() * (a * a.transpose() + b * b.transpose());
        light.direction = (light.direction + turn(bits) * a + turn(bits) * b).normalized();
    }
    return lights;
}

/// Errors over predictions on smooth-lit spheres, several seeds.
std::vector<double> ratios(const Case& c, double light_sigma_deg) {
    std::vector<double> all;
    const NoiseModel channel{2e-3, 2e-4, 0};
    for (unsigned seed = 1; seed <= (light_sigma_deg > 0 ? 16U : 3U); ++seed) {
        test::LitSphere sphere(test::spiral_lights(c.lights), test::lambert, 32, 28);
        sphere.add_noise(channel, seed);
        PhotometricStereoOptions options;
        options.solver = c.solver;
        if (c.noise_given) options.model.noise = NoiseModel{2e-3 / std::sqrt(3.0), 2e-4 / 3, 0};
        const Lights lights = uncertain(sphere.lights, light_sigma_deg, 100 + seed);
        const auto result = photometric_stereo(sphere.stack, light_sigma_deg > 0 ? lights : sphere.lights, options);
        for (int y = 0; y < 32; ++y)
            for (int x = 0; x < 32; ++x)
                if (result.normals.valid(y, x))
                    all.push_back(sphere.error_deg(result, y, x) / static_cast<double>(result.sigma_deg(y, x)));
    }
    return all;
}

class PredictedSigma : public testing::TestWithParam<Case> {};

TEST_P(PredictedSigma, IsTrueForNoise) {
    const std::vector<double> r = ratios(GetParam(), 0);
    EXPECT_NEAR(test::quantile(r, 0.5) / median_of_rayleigh, 1.0, 0.2);
    EXPECT_NEAR(static_cast<double>(std::count_if(r.begin(), r.end(), [](double x) { return x < 2.4477; })) /
                    static_cast<double>(r.size()),
                0.95, 0.05);
}

TEST_P(PredictedSigma, IsTrueForUncertainLights) {
    const std::vector<double> r = ratios(GetParam(), 1.0);
    EXPECT_NEAR(test::quantile(r, 0.5) / median_of_rayleigh, 1.0, 0.2);
}

INSTANTIATE_TEST_SUITE_P(Solvers, PredictedSigma,
                         testing::Values(Case{Solver::lsq, 6, true}, Case{Solver::lsq, 6, false},
                                         Case{Solver::lsq, 24, true}, Case{Solver::lsq, 24, false},
                                         Case{Solver::robust, 6, true}, Case{Solver::robust, 12, false},
                                         Case{Solver::robust, 24, true}, Case{Solver::robust, 24, false}),
                         [](const auto& which) {
                             const Case& c = which.param;
                             return std::string(c.solver == Solver::lsq ? "lsq" : "robust") + std::to_string(c.lights) +
                                    (c.noise_given ? "given" : "found");
                         });

}  // namespace
}  // namespace darkbox
