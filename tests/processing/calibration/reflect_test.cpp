#include "processing/calibration/reflect.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace darkbox {
namespace {

const Ball ball{100, 80, 50, 1.0};

TEST(ReflectAt, CentreOfTheBallMirrorsTheCamera) {
    EXPECT_LT(angle_deg(reflect_at(ball, 100, 80).value(), {0, 0, 1}), 1e-9);
}

TEST(ReflectAt, TurnsTwiceAsFarAsTheNormal) {
    // The common mistake is to return the normal: it would lie at 22.5 degrees here, and the object look stretched.
    const double slant = 22.5 * std::numbers::pi / 180;
    const auto light = reflect_at(ball, 100 + 50 * std::sin(slant), 80).value();
    EXPECT_LT(angle_deg(light, Eigen::Vector3d(1, 0, 1).normalized()), 1e-9);
}

TEST(ReflectAt, HighlightAboveTheCentreComesFromAbove) {
    EXPECT_GT(reflect_at(ball, 100, 60).value().y(), 0.5);  // v runs down, y up
    EXPECT_LT(reflect_at(ball, 80, 80).value().x(), -0.5);
}

TEST(ReflectAt, NoDirectionOutsideTheBall) { EXPECT_FALSE(reflect_at(ball, 151, 80)); }

TEST(HighlightOf, IsTheInverse) {
    const Eigen::Vector3d light = Eigen::Vector3d(0.4, -0.5, 0.6).normalized();
    const auto at = highlight_of(ball, light).value();
    EXPECT_LT(angle_deg(reflect_at(ball, at.x, at.y).value(), light), 1e-9);
    EXPECT_FALSE(highlight_of(ball, {0, 0, -1}));
}

}  // namespace
}  // namespace darkbox
