#include <gmock/gmock.h>

#include "acquisition/frame/error.h"
#include "rig/capture/capture_run.h"

namespace darkbox {
namespace {

std::vector<std::string> names(const CapturePlan& plan) {
    std::vector<std::string> names;
    for (const Shot& shot : plan.shots) names.push_back(shot.name);
    return names;
}

class CapturePlanTest : public testing::Test {
protected:
    RigDescription rig = parse_rig(simulated_rig_toml(4), "rig.toml");
};

TEST_F(CapturePlanTest, IsDarkThenEveryLampThenDark) {
    const CapturePlan plan = plan_capture(rig);
    EXPECT_THAT(names(plan), testing::ElementsAre("0000_dark", "0001_lamp-01", "0002_lamp-02", "0003_lamp-03",
                                                  "0004_lamp-04", "0005_dark"));
    EXPECT_EQ(plan.shots[3].lamp, LampId{2});
    EXPECT_EQ(plan.shots[3].kind, FrameKind::lit);
    EXPECT_EQ(plan.shots[5].lamp, std::nullopt);
    EXPECT_EQ(plan.shots[5].kind, FrameKind::dark);
    EXPECT_EQ(plan.shots[3].camera.exposure, rig.camera.exposure);
}

TEST_F(CapturePlanTest, TakesNamedLampsInTheRigsOrder) {
    const CapturePlan plan = plan_capture(rig, {"lamp-04", "lamp-02"});
    EXPECT_THAT(names(plan), testing::ElementsAre("0000_dark", "0001_lamp-02", "0002_lamp-04", "0003_dark"));
    EXPECT_EQ(plan.shots[2].lamp, LampId{3});
}

TEST_F(CapturePlanTest, NamesAnUnknownLampAndTheKnownOnes) {
    try {
        plan_capture(rig, {"lamp-02", "lamp-9"});
        FAIL();
    } catch (const InputError& error) {
        EXPECT_STREQ(error.what(), "the rig has no lamp 'lamp-9'");
        EXPECT_EQ(error.hint(), "its lamps are: lamp-01, lamp-02, lamp-03, lamp-04");
    }
    EXPECT_THROW(plan_capture(rig, {"lamp-02", "lamp-02"}), InputError);
}

TEST_F(CapturePlanTest, AveragesPassAfterPassWithDarkFramesBetween) {
    rig.capture.averages = 2;
    rig.capture.dark_every = 3;
    EXPECT_THAT(
        names(plan_capture(rig)),
        testing::ElementsAre("0000_dark", "0001_lamp-01", "0002_lamp-02", "0003_lamp-03", "0004_dark", "0005_lamp-04",
                             "0006_lamp-01", "0007_lamp-02", "0008_dark", "0009_lamp-03", "0010_lamp-04", "0011_dark"));
    rig.capture.dark_every = 8;
    EXPECT_EQ(plan_capture(rig).shots.size(), 10U) << "the closing dark frame is not taken twice";
}

TEST_F(CapturePlanTest, BracketsAreExposuresOneAfterTheOther) {
    rig.capture.brackets = {1, 0.25};
    const CapturePlan plan = plan_capture(rig, {"lamp-02"});
    EXPECT_THAT(names(plan), testing::ElementsAre("0000_dark", "0001_lamp-02", "0002_dark", "0003_dark", "0004_lamp-02",
                                                  "0005_dark"));
    EXPECT_EQ(plan.shots[2].camera.exposure, Seconds(0.02));
    EXPECT_EQ(plan.shots[3].camera.exposure, Seconds(0.005));
}

TEST_F(CapturePlanTest, ARoomThatIsNotDarkMakesAmbientFrames) {
    rig.capture.ambient = true;
    const CapturePlan plan = plan_capture(rig, {"lamp-02"});
    EXPECT_THAT(names(plan), testing::ElementsAre("0000_ambient", "0001_lamp-02", "0002_ambient"));
    EXPECT_EQ(plan.shots[0].kind, FrameKind::ambient);
}

TEST_F(CapturePlanTest, RefusesWhatALampDoesNotBear) {
    rig.lamps[1].max_on = Seconds(0.1);
    rig.capture.brackets = {1, 5};
    try {
        plan_capture(rig);
        FAIL();
    } catch (const InputError& error) {
        EXPECT_STREQ(error.what(), "an exposure of 100 ms is longer than lamp 'lamp-02' may shine: max_on_s is 0.1");
    }
}

TEST_F(CapturePlanTest, ExposuresAreWholePeriodsOfTheFlicker) {
    rig.flicker_hz = 100;
    EXPECT_NO_THROW(plan_capture(rig));
    rig.capture.brackets = {1, 0.25};
    try {
        plan_capture(rig);
        FAIL();
    } catch (const InputError& error) {
        EXPECT_STREQ(error.what(), "an exposure of 5 ms is 0.500 periods of the lamps' flicker");
        EXPECT_EQ(error.hint(), "make it a whole number of periods of 10 ms, or let it be metered");
    }
}

TEST_F(CapturePlanTest, EndsWithTheFirstLampWhereAskedFor) {
    rig.capture.closing_repeat = true;
    rig.capture.brackets = {1, 0.25};
    EXPECT_THAT(names(plan_capture(rig, {"lamp-02", "lamp-04"})),
                testing::ElementsAre("0000_dark", "0001_lamp-02", "0002_lamp-04", "0003_dark", "0004_dark",
                                     "0005_lamp-02", "0006_lamp-04", "0007_lamp-02", "0008_dark"));
}

}  // namespace
}  // namespace darkbox
