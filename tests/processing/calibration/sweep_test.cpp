// A bounded part of the sweep that bench_calibration prints: rendered balls, photographed with noise.

#include "tests/processing/calibration/sweep.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

namespace darkbox::test {
namespace {

using Lamps = SweepSetting::Lamps;

SweepErrors swept(const char* name, const SweepSetting& setting) {
    const SweepErrors errors = sweep(setting).front();
    fmt::print(
        "{}: median {:.3f} degrees raw, {:.3f} refined; {:.0f}, {:.0f}, {:.0f} % below the 50, 90, 95 % points\n", name,
        errors.raw_median(), errors.refined_median(), 100 * errors.share_below(0.5), 100 * errors.share_below(0.9),
        100 * errors.share_below(0.95));
    return errors;
}

TEST(Sweep, RefinedDirectionsAreWithinATenthAndAHalfOfADegreeAndAThirdOfRaw) {
    SweepSetting setting;
    const SweepErrors errors = swept("distant", setting);
    EXPECT_EQ(errors.unread, 0);
    EXPECT_LE(errors.refined_median(), 0.15);
    EXPECT_LE(errors.refined_median(), errors.raw_median() / 3);
}

/// Three noise levels, on other scenes than the constants of spot.cpp and outline_fit.cpp were measured on. What errs
/// alike in all lights of a scene makes scenes count, not lights: with twelve, the share below the 50 % point has a
/// standard deviation of up to 14 %. bench_calibration has more scenes.
void at_three_noises(const char* name, bool wall) {
    SweepErrors all;
    for (const double full_well : {100000.0, 20000.0, 4000.0}) {
        SweepSetting setting;
        setting.full_wells_e = {full_well};
        setting.seed = 40 + static_cast<std::uint64_t>(full_well / 4000);
        setting.lights = 9;
        setting.wall = wall;
        gather(all, swept(name, setting));
    }
    fmt::print("{}, all: median {:.3f} degrees raw, {:.3f} refined; {:.1f}, {:.1f}, {:.1f} %\n", name, all.raw_median(),
               all.refined_median(), 100 * all.share_below(0.5), 100 * all.share_below(0.9),
               100 * all.share_below(0.95));
    EXPECT_EQ(all.unread, 0);
    EXPECT_LE(all.refined_median(), 0.15);
    EXPECT_LE(all.refined_median(), all.raw_median() / 3);
    EXPECT_GE(all.share_below(0.5), 0.45);
    EXPECT_GE(all.share_below(0.9), 0.85);
    EXPECT_GE(all.share_below(0.95), 0.90);
}

TEST(Sweep, BeforeAWallCovariancesAreNotTooSmall) { at_three_noises("wall", true); }

TEST(Sweep, InARoomOfGradientsNeither) { at_three_noises("room", false); }

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
