#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>

#include "processing/calibration/ball_contour.h"
#include "processing/calibration/outline.h"
#include "tests/processing/calibration/ball_scene.h"

namespace darkbox {
namespace {

using test::BallScene;

double error_px(const BallScene& scene) {
    const cv::Mat1f mean = mean_over_frames(test::photographs(scene, test::dome_of_lights(6)));
    const BallContour contour =
        measure_contour(mean, {scene.ball.x + 0.7, scene.ball.y - 0.5, scene.ball.radius + 0.4});
    const double error = std::hypot(contour.circle.x - scene.ball.x, contour.circle.y - scene.ball.y,
                                    contour.circle.radius - scene.ball.radius);
    fmt::print("radius {:.1f}, noise {:.3f}: error {:.3f} px, spread {:.3f} px, support {:.2f}\n", scene.ball.radius,
               scene.noise, error, contour.spread_px, contour.support);
    return error;
}

BallScene ball_of(double radius, double noise) {
    BallScene scene;
    scene.ball.radius = radius;
    scene.noise = noise;
    return scene;
}

// What the ball mirrors is brighter above than below: the steepest gradient lies up to 0.1 px off the outline.
TEST(MeasureContour, MirroredRoomDoesNotPull) {
    EXPECT_LT(error_px(ball_of(60.2, 0)), 0.03);
    EXPECT_LT(error_px(ball_of(30.2, 0)), 0.05);
    EXPECT_LT(error_px(ball_of(15.2, 0)), 0.10);
}

TEST(MeasureContour, NoiseAveragesOut) {
    EXPECT_LT(error_px(ball_of(60.2, 0.01)), 0.10);
    EXPECT_LT(error_px(ball_of(30.2, 0.01)), 0.20);
}

}  // namespace
}  // namespace darkbox
