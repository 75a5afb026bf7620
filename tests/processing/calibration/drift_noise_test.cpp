#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "processing/calibration/drift.h"
#include "tests/processing/calibration/drift_scene.h"

namespace darkbox {
namespace {

using test::dome;
using test::found;
using testing::ElementsAre;

/// Of all lamps over many comparisons, the share whose movement chance explains with less than `p`.
struct Rates {
    double p50 = 0, p10 = 0, p05 = 0;
    double alarms = 0;  ///< comparisons with any finding
    double knocks = 0;
};

template <class After>
Rates rates(int comparisons, int lamps, After after) {
    std::mt19937 random(7);
    Rates sum;
    double judged = 0;
    for (int i = 0; i < comparisons; ++i) {
        const Drift drift = drift_between(test::measured(dome(lamps), random), test::measured(after, random));
        for (const LampDrift& lamp : drift.lamps) {
            sum.p50 += lamp.p_value < 0.5;
            sum.p10 += lamp.p_value < 0.1;
            sum.p05 += lamp.p_value < 0.05;
            judged += 1;
        }
        sum.alarms +=
            !found(drift, LampFinding::steady).empty() && found(drift, LampFinding::steady).size() < drift.lamps.size();
        sum.knocks += drift.knock.has_value();
    }
    return {sum.p50 / judged, sum.p10 / judged, sum.p05 / judged, sum.alarms / comparisons, sum.knocks / comparisons};
}

// 2000 comparisons of 12 lamps: a rate of 1 % is known to 0.22 %, one of 5 % of lamps to 0.14 %.

TEST(DriftUnderNoise, SteadyLampsRaiseFalseAlarmsAsOftenAsPromised) {
    const Rates noise = rates(2000, 12, dome(12));
    EXPECT_NEAR(noise.p50, 0.50, 0.01);
    EXPECT_NEAR(noise.p10, 0.10, 0.006);
    EXPECT_NEAR(noise.p05, 0.05, 0.0045);
    EXPECT_NEAR(noise.alarms, 0.01, 0.007);
    EXPECT_LE(noise.knocks, 0.01);
}

TEST(DriftUnderNoise, SteadyLampsInAKnockedCameraToo) {
    const Rates noise = rates(2000, 12, test::turned(dome(12), test::knock_of_deg(3)));
    EXPECT_EQ(noise.knocks, 1);
    EXPECT_NEAR(noise.p50, 0.50, 0.015);
    EXPECT_NEAR(noise.p10, 0.10, 0.009);
    EXPECT_NEAR(noise.p05, 0.05, 0.0068);
    EXPECT_NEAR(noise.alarms, 0.01, 0.007);
}

/// A ball that is read a little aside turns every lamp alike, within each lamp's own uncertainty.
TEST(DriftUnderNoise, ErrorsThatAllLampsShareAreNoKnock) {
    std::mt19937 random(7);
    std::normal_distribution<double> normal(0, 0.14 * M_PI / 180);  // both calibrations' 0.1 degrees per axis
    int knocks = 0;
    for (int i = 0; i < 1000; ++i) {
        const Eigen::Vector3d turn(normal(random), normal(random), 0);
        const RigLights after = test::turned(dome(12), Eigen::AngleAxisd(turn.norm(), turn.normalized()));
        knocks += drift_between(dome(12), after).knock.has_value();
    }
    EXPECT_LE(knocks, 25);
}

TEST(DriftUnderNoise, AMovedLampInAKnockedCameraIsFoundEachTime) {
    std::mt19937 random(7);
    RigLights after = dome(12);
    test::move_lamp(after, 4, 1.5);
    after = test::turned(after, test::knock_of_deg(3));
    int right = 0;
    for (int i = 0; i < 300; ++i) {
        const Drift drift = drift_between(test::measured(dome(12), random), test::measured(after, random));
        right += drift.knock && found(drift, LampFinding::moved) == std::vector<std::string>{"lamp-5"} &&
                 found(drift, LampFinding::steady).size() == 11;
    }
    EXPECT_GE(right, 291);
}

TEST(DriftUnderNoise, SwappedLampsInAKnockedCameraAreFoundEachTime) {
    std::mt19937 random(7);
    RigLights after = dome(12);
    test::swap_lamps(after, 2, 7);
    after = test::turned(after, test::knock_of_deg(3));
    int right = 0;
    for (int i = 0; i < 300; ++i) {
        const Drift drift = drift_between(test::measured(dome(12), random), test::measured(after, random));
        right += drift.knock && found(drift, LampFinding::swapped) == std::vector<std::string>{"lamp-3", "lamp-8"};
    }
    EXPECT_EQ(right, 300);
}

TEST(DriftUnderNoise, AThirdOfTheLampsMayMoveBeforeTheKnockIsLost) {
    std::mt19937 random(7);
    RigLights after = dome(12);
    for (const std::size_t lamp : {1u, 4u, 6u, 10u}) test::move_lamp(after, lamp, 4.0 + static_cast<double>(lamp));
    after = test::turned(after, test::knock_of_deg(3));
    const Drift drift = drift_between(test::measured(dome(12), random), test::measured(after, random));
    ASSERT_TRUE(drift.knock);
    EXPECT_NEAR(drift.knock->angle_deg, 3, 0.3);
    EXPECT_THAT(found(drift, LampFinding::moved), ElementsAre("lamp-2", "lamp-5", "lamp-7", "lamp-11"));
}

}  // namespace
}  // namespace darkbox
