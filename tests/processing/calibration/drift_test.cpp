#include "processing/calibration/drift.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/processing/calibration/drift_scene.h"
#include "tests/support/throws.h"

namespace darkbox {
namespace {

using test::dome;
using test::found;
using test::lamp_of;
using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::SizeIs;

TEST(Drift, TheSameCalibrationTwiceIsSteady) {
    const Drift drift = drift_between(dome(12), dome(12));
    EXPECT_TRUE(drift.steady());
    EXPECT_FALSE(drift.knock);
    ASSERT_THAT(drift.lamps, SizeIs(12));
    for (const LampDrift& lamp : drift.lamps) {
        EXPECT_NEAR(lamp.moved_deg, 0, 1e-9);
        EXPECT_NEAR(lamp.p_value, 1, 1e-6);
        EXPECT_FALSE(lamp.sigma_assumed);
    }
}

TEST(Drift, OneMovedLampIsFoundWithItsAngleAndSignificance) {
    RigLights after = dome(12);
    test::move_lamp(after, 4, 2.0);
    const Drift drift = drift_between(dome(12), after);
    EXPECT_THAT(found(drift, LampFinding::moved), ElementsAre("lamp-5"));
    EXPECT_FALSE(drift.knock);
    EXPECT_NEAR(lamp_of(drift, "lamp-5").moved_deg, 2.0, 1e-6);
    EXPECT_NEAR(lamp_of(drift, "lamp-5").sigma_deg, 0.1 * std::sqrt(2), 1e-3);
    EXPECT_NEAR(lamp_of(drift, "lamp-5").p_value, std::exp(-0.5 * 2.0 * 2.0 / 0.02), 1e-40);
    EXPECT_THAT(drift.findings, ElementsAre(HasSubstr("lamp-5 moved by 2.00 degrees")));
}

TEST(Drift, AMovementWithinItsUncertaintyIsNone) {
    RigLights after = dome(12, 1.0);
    test::move_lamp(after, 4, 2.0);
    EXPECT_TRUE(drift_between(dome(12, 1.0), after).steady());
}

TEST(Drift, LampsAreMatchedByNameNotByOrder) {
    RigLights after = dome(12);
    test::move_lamp(after, 4, 2.0);
    std::reverse(after.lights.begin(), after.lights.end());
    std::reverse(after.rig.lamps.begin(), after.rig.lamps.end());
    EXPECT_THAT(found(drift_between(dome(12), after), LampFinding::moved), ElementsAre("lamp-5"));
}

RigLights standing_at(RigLights rig, double distance_mm) {
    for (Light& light : rig.lights)
        light.near = LampPosition{distance_mm * light.direction, {0, 0, 0}, 0.5 * Eigen::Matrix3d::Identity()};
    return rig;
}

TEST(Drift, NearAndDistantCannotBeCompared) {
    const std::string words = test::input_error_of([] { drift_between(dome(12), standing_at(dome(12), 400)); });
    EXPECT_THAT(words, HasSubstr("lamp-1 as a near lamp"));
}

TEST(Drift, NearLampsAreComparedAsOneAndTheSameObjectSeesThem) {
    RigLights before = standing_at(dome(12), 400), after = before;
    for (Light& light : after.lights) light = held_at(light, {60, -30, 0});
    EXPECT_GT(angle_deg(before.lights[0].direction, after.lights[0].direction), 5);
    const Drift drift = drift_between(before, after);
    EXPECT_TRUE(drift.steady());
    EXPECT_NEAR(lamp_of(drift, "lamp-1").moved_deg, 0, 1e-6);
}

TEST(Drift, ANearLampThatMovedAlongItsRayIsFoundByItsDistance) {
    const RigLights before = standing_at(dome(12), 400);
    RigLights after = before;
    after.lights[4].near->position_mm *= 1.02;
    const Drift drift = drift_between(before, after);
    EXPECT_THAT(found(drift, LampFinding::moved), ElementsAre("lamp-5"));
    EXPECT_NEAR(lamp_of(drift, "lamp-5").farther_mm.value(), 8, 1e-6);
    EXPECT_NEAR(lamp_of(drift, "lamp-5").farther_sigma_mm, 1, 1e-9);
    EXPECT_NEAR(lamp_of(drift, "lamp-5").moved_deg, 0, 1e-6);
    EXPECT_THAT(drift.findings, ElementsAre(HasSubstr("stands 8 mm farther")));
    after.lights[4].near->position_mm = before.lights[4].near->position_mm * 1.005;
    EXPECT_TRUE(drift_between(before, after).steady()) << "2 mm are within an uncertainty of 1 mm";
}

TEST(Drift, AScaleReadOtherwiseIsNoLampsMovement) {
    const RigLights before = standing_at(dome(12), 400);
    RigLights after = before;
    for (Light& light : after.lights) light.near->position_mm *= 1.03;
    const Drift drift = drift_between(before, after);
    EXPECT_TRUE(drift.steady());
    EXPECT_NEAR(lamp_of(drift, "lamp-5").farther_mm.value(), 0, 1e-6);
}

TEST(Drift, SwappedLampsAreNamedOnceAsAPair) {
    RigLights after = dome(12);
    test::swap_lamps(after, 2, 7);
    const Drift drift = drift_between(dome(12), after);
    EXPECT_THAT(found(drift, LampFinding::swapped), ElementsAre("lamp-3", "lamp-8"));
    EXPECT_EQ(lamp_of(drift, "lamp-3").partner, "lamp-8");
    EXPECT_THAT(drift.findings, ElementsAre(HasSubstr("lamp-3 and lamp-8 are swapped")));
}

TEST(Drift, ThreeLampsInAnotherOrderAreSwappedToo) {
    RigLights after = dome(12);
    test::swap_lamps(after, 2, 7);
    test::swap_lamps(after, 7, 9);
    EXPECT_THAT(found(drift_between(dome(12), after), LampFinding::swapped),
                ElementsAre("lamp-3", "lamp-8", "lamp-10"));
}

TEST(Drift, OneLampUnderTwoNamesIsADuplicate) {
    RigLights after = dome(12);
    after.lights[2].direction = after.lights[7].direction;
    after.lights[2].covariance = after.lights[7].covariance;
    const Drift drift = drift_between(dome(12), after);
    EXPECT_THAT(found(drift, LampFinding::duplicate), ElementsAre("lamp-3"));
    EXPECT_EQ(lamp_of(drift, "lamp-3").partner, "lamp-8");
    EXPECT_EQ(lamp_of(drift, "lamp-8").finding, LampFinding::steady);
}

TEST(Drift, TwoLampsInOneNewPlaceAreDuplicates) {
    RigLights after = dome(12);
    test::move_lamp(after, 2, 9.0);
    after.lights[7] = after.lights[2];
    EXPECT_THAT(found(drift_between(dome(12), after), LampFinding::duplicate), ElementsAre("lamp-3", "lamp-8"));
}

TEST(Drift, AKnockedCameraIsOneFindingAndNotTwelve) {
    const Drift drift = drift_between(dome(12), test::turned(dome(12), test::knock_of_deg(3)));
    ASSERT_TRUE(drift.knock);
    EXPECT_NEAR(drift.knock->angle_deg, 3, 1e-6);
    EXPECT_NEAR(drift.knock->axis.dot(Eigen::Vector3d(1, 2, 0.5).normalized()), 1, 1e-9);
    EXPECT_EQ(drift.knock->lamps, 12u);
    EXPECT_THAT(drift.findings, ElementsAre(HasSubstr("camera was knocked")));
    EXPECT_GT(lamp_of(drift, "lamp-1").raw_deg, 1);
    EXPECT_NEAR(lamp_of(drift, "lamp-1").moved_deg, 0, 1e-6);
}

TEST(Drift, AMovedLampIsToldFromTheKnockOfTheCamera) {
    RigLights after = dome(12);
    test::move_lamp(after, 4, 2.0);
    const Drift drift = drift_between(dome(12), test::turned(after, test::knock_of_deg(3)));
    ASSERT_TRUE(drift.knock);
    EXPECT_NEAR(drift.knock->angle_deg, 3, 1e-6);
    EXPECT_EQ(drift.knock->lamps, 11u);
    EXPECT_THAT(found(drift, LampFinding::moved), ElementsAre("lamp-5"));
    EXPECT_NEAR(lamp_of(drift, "lamp-5").moved_deg, 2.0, 1e-6);
}

TEST(Drift, SwappedLampsInAKnockedCamera) {
    RigLights after = dome(12);
    test::swap_lamps(after, 2, 7);
    const Drift drift = drift_between(dome(12), test::turned(after, test::knock_of_deg(4)));
    ASSERT_TRUE(drift.knock);
    EXPECT_EQ(drift.knock->lamps, 10u);
    EXPECT_THAT(found(drift, LampFinding::swapped), ElementsAre("lamp-3", "lamp-8"));
    EXPECT_THAT(found(drift, LampFinding::moved), IsEmpty());
}

TEST(Drift, DimAndDeadLampsByTheirIntensities) {
    RigLights before = dome(9), after = dome(9);
    before.intensities_known = after.intensities_known = true;
    for (Light& light : after.lights) light.intensity *= 2;  // another exposure
    after.lights[3].intensity *= 0.6;
    after.lights[5].intensity *= 0.01;
    const Drift drift = drift_between(before, after);
    EXPECT_THAT(found(drift, LampFinding::dim), ElementsAre("lamp-4"));
    EXPECT_THAT(found(drift, LampFinding::dead), ElementsAre("lamp-6"));
    EXPECT_NEAR(lamp_of(drift, "lamp-4").intensity_ratio.value(), 0.6, 1e-9);
    after.intensities_known = false;
    EXPECT_TRUE(drift_between(before, after).steady());
}

TEST(Drift, ALampWithoutAReadingIsDeadAndOneThatNeverHadOneIsUnread) {
    RigLights before = dome(9), after = dome(9);
    after.lights[3].used = false;
    before.lights[5].used = false;
    const Drift drift = drift_between(before, after);
    EXPECT_EQ(lamp_of(drift, "lamp-4").finding, LampFinding::dead);
    EXPECT_EQ(lamp_of(drift, "lamp-6").finding, LampFinding::unread);
    EXPECT_THAT(drift.findings, ElementsAre(HasSubstr("lamp-4 was read before"), HasSubstr("lamp-6 was not read")));
}

TEST(Drift, AnUnknownCovarianceIsSaidAndReplaced) {
    RigLights before = dome(9), after = dome(9);
    before.lights[3].covariance.setZero();
    test::move_lamp(after, 3, 3.0);
    const Drift drift = drift_between(before, after);
    EXPECT_TRUE(lamp_of(drift, "lamp-4").sigma_assumed);
    EXPECT_NEAR(lamp_of(drift, "lamp-4").sigma_deg, std::hypot(0.5, 0.1), 1e-3);
    EXPECT_THAT(drift.findings, ElementsAre(HasSubstr("uncertainty is not known")));
}

TEST(Drift, AnotherRigIsRefusedUnlessAskedFor) {
    RigLights other = dome(9);
    other.rig.name = "arch";
    EXPECT_THAT(test::input_error_of([&] { drift_between(dome(9), other); }), HasSubstr("'dome', the other of 'arch'"));
    other.rig = {"", {}};
    for (std::size_t i = 0; i < 9; ++i) other.lights[i].file = "photograph-" + std::to_string(i);
    EXPECT_THAT(test::input_error_of([&] { drift_between(dome(9), other); }), HasSubstr("single lamp"));
    DriftOptions options;
    options.other_rig = OtherRig::compare;
    EXPECT_TRUE(drift_between(dome(9), other, options).steady());
    other.lights.pop_back();
    EXPECT_THROW(drift_between(dome(9), other, options), InputError);
}

TEST(Drift, LampsThatCameAndWentAreTold) {
    RigLights after = dome(9);
    after.rig.lamps[8] = "lamp-new";
    const Drift drift = drift_between(dome(9), after);
    EXPECT_THAT(drift.only_before, ElementsAre("lamp-9"));
    EXPECT_THAT(drift.only_after, ElementsAre("lamp-new"));
    EXPECT_THAT(drift.findings, Contains(HasSubstr("lamp-9 is missing")));
}

TEST(Drift, BadOptionsNameTheField) {
    DriftOptions options;
    options.false_alarm = 1;
    EXPECT_THAT(test::input_error_of([&] { drift_between(dome(9), dome(9), options); }), HasSubstr("false_alarm"));
}

}  // namespace
}  // namespace darkbox
