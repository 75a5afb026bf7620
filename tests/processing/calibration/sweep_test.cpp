// A bounded part of the sweep that bench_calibration prints: rendered balls, photographed with noise.

#include "tests/processing/calibration/sweep.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

namespace darkbox::test {
namespace {

using Lamps = SweepSetting::Lamps;

SweepErrors swept(const char* name, const SweepSetting& setting) {
    const SweepErrors errors = sweep(setting);
    fmt::print(
        "{}: median {:.3f} degrees raw, {:.3f} refined; {:.0f}, {:.0f}, {:.0f} % below the 50, 90, 95 % points\n", name,
        errors.raw_median(), errors.refined_median(), 100 * errors.share_below(0.5), 100 * errors.share_below(0.9),
        100 * errors.share_below(0.95));
    return errors;
}

TEST(Sweep, RefinedDirectionsAreWithinATenthAndAHalfOfADegreeAndAThirdOfRaw) {
    SweepSetting setting;
    setting.captures = 8;
    const SweepErrors errors = swept("distant", setting);
    EXPECT_EQ(errors.unread, 0);
    EXPECT_LE(errors.refined_median(), 0.15);
    EXPECT_LE(errors.refined_median(), errors.raw_median() / 3);
}

TEST(Sweep, ParallaxBetweenBallAndObjectIsCorrected) {
    // Lamps at 1 m, the object 100 mm beside the ball: read at the ball, directions are off by up to 5.7 degrees.
    SweepSetting setting;
    setting.captures = 2;
    setting.lights = 9;
    setting.lamps = Lamps::near_one_ball;
    const SweepErrors one = swept("near, one ball and the rig", setting);
    EXPECT_GT(one.raw_deg.back(), 5);
    EXPECT_LE(one.refined_median(), 0.15);
    setting.lamps = Lamps::near_two_balls;
    const SweepErrors two = swept("near, two balls", setting);
    EXPECT_GT(two.raw_median(), 1);
    EXPECT_LE(two.refined_median(), 0.15);
    EXPECT_LE(two.refined_median(), two.raw_median() / 3);
}

TEST(Sweep, PerspectiveIsReadAsWell) {
    SweepSetting setting;
    setting.captures = 2;
    setting.lights = 9;
    setting.perspective = true;
    const SweepErrors errors = swept("distant, perspective", setting);
    EXPECT_LE(errors.refined_median(), 0.15);
    EXPECT_LE(errors.refined_median(), errors.raw_median() / 3);
}

}  // namespace
}  // namespace darkbox::test
