#include "processing/calibration/lamp_checks.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "processing/calibration/warnings.h"
#include "tests/processing/calibration/drift_scene.h"

namespace darkbox {
namespace {

using test::dome;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

RigLights described(int lamps) { return dome(lamps, 0); }

TEST(AgainstNominal, ARigBuiltToItsDescriptionIsFine) {
    std::mt19937 random(3);
    EXPECT_THAT(against_nominal(described(12), test::measured(dome(12, 2.0), random)), IsEmpty());
}

TEST(AgainstNominal, NearLampsAreSeenFromTheObjectAsDescribed) {
    RigLights read = dome(12);
    for (Light& light : read.lights) light.near = LampPosition{400 * light.direction, {0, 0, 0}};
    EXPECT_THAT(against_nominal(described(12), read), IsEmpty());
}

TEST(AgainstNominal, SwappedLampsAreNamed) {
    RigLights read = dome(12);
    test::swap_lamps(read, 2, 7);
    EXPECT_THAT(against_nominal(described(12), read),
                ElementsAre(HasSubstr("lamp-3 shines from where the rig's description has lamp-8"),
                            HasSubstr("lamp-8 shines from where the rig's description has lamp-3")));
}

TEST(AgainstNominal, ALampFarFromItsPlaceIsNamed) {
    RigLights read = dome(12);
    test::move_lamp(read, 5, 25);
    const auto words = against_nominal(described(12), read);
    ASSERT_THAT(words, testing::SizeIs(1));
    EXPECT_THAT(words[0], HasSubstr("lamp-6"));
}

TEST(AgainstNominal, ACameraThatLooksFromAsideIsNoFault) {
    EXPECT_THAT(against_nominal(described(12), test::turned(dome(12), test::knock_of_deg(20))), IsEmpty());
}

TEST(AgainstNominal, AnotherRigsDescriptionSaysNothing) {
    RigLights other = described(12);
    other.rig.name = "arch";
    test::swap_lamps(other, 2, 7);
    EXPECT_THAT(against_nominal(other, dome(12)), IsEmpty());
}

TEST(Warnings, LampsInOnePlaceAreNamedInOneSentence) {
    Calibration calibration;
    calibration.lights = dome(9).lights;
    for (const std::size_t lamp : {4U, 6U, 8U}) calibration.lights[lamp].direction = calibration.lights[1].direction;
    calibration.lights[7].direction = calibration.lights[2].direction;
    EXPECT_THAT(warnings_about(calibration),
                ElementsAre(HasSubstr("frame-2.png, frame-5.png, frame-7.png and frame-9.png were lit from the same"),
                            HasSubstr("frame-3.png and frame-8.png were lit from the same")));
}

TEST(WeakLamps, AreDimOrDeadBesideTheMedian) {
    Lights lights = dome(9).lights;
    lights[2].intensity *= 0.4;
    lights[6].intensity *= 0.01;
    EXPECT_THAT(weak_lamps(lights),
                ElementsAre(HasSubstr("frame-3.png is dim: 40 %"), HasSubstr("frame-7.png is dead")));
}

}  // namespace
}  // namespace darkbox
