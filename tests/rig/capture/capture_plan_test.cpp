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

}  // namespace
}  // namespace darkbox
