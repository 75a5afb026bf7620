// The robust solver on rendered scenes with broad and narrow highlights, cast shadows and a camera's noise.

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <string>
#include <tuple>

#include "processing/normals/photometric_stereo.h"
#include "tests/support/simulated_stack.h"

namespace darkbox {
namespace {

/// Over all of the mask; a pixel without a normal is 90 degrees off.
double mean_error_deg(const test::SimulatedStack& shot, const PhotometricStereoResult& result) {
    double sum = 0;
    for (int y = 0; y < shot.normals.rows; ++y)
        for (int x = 0; x < shot.normals.cols; ++x) {
            if (!shot.stack.mask(y, x)) continue;
            const cv::Vec3f &n = result.normals.normal(y, x), &t = shot.normals(y, x);
            sum += result.normals.valid(y, x) ? angle_deg({n[0], n[1], n[2]}, {t[0], t[1], t[2]}) : 90.0;
        }
    return sum / cv::countNonZero(shot.stack.mask);
}

class GlossyScenes : public testing::TestWithParam<std::tuple<std::string, int, int>> {};

TEST_P(GlossyScenes, WithCastShadowsErrAThirdOfLeastSquares) {
    const auto& [shape, percent, exponent] = GetParam();
    const test::SimulatedStack shot =
        test::simulated_stack(fmt::format("{}-phong{}n{}", shape, percent, exponent), 24, 64);
    const auto error = [&](Solver solver) {
        PhotometricStereoOptions options;
        options.solver = solver;
        return mean_error_deg(shot, photometric_stereo(shot.stack, shot.lights, options));
    };
    EXPECT_LE(error(Solver::robust), error(Solver::lsq) / 3);
}

INSTANTIATE_TEST_SUITE_P(Robust, GlossyScenes,
                         testing::Combine(testing::Values("sphere", "torus", "relief", "teapot"),
                                          testing::Values(30, 60), testing::Values(10, 30, 100)),
                         [](const auto& scene) {
                             return fmt::format("{}Phong{}N{}", std::get<0>(scene.param), std::get<1>(scene.param),
                                                std::get<2>(scene.param));
                         });

}  // namespace
}  // namespace darkbox
