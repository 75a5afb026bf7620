#include "sim/faults.h"

#include <gtest/gtest.h>

#include "acquisition/device/device_error.h"
#include "sim/sim_rig.h"
#include "tests/sim/sim_test_support.h"

namespace darkbox::sim {
namespace {

/// A camera that streams with this fault while lamp 2 burns.
SimRig lit_rig(const std::string& faults) {
    SimRig rig = SimRig::make(small_rig(), parse_faults(faults));
    rig.camera().configure({});
    rig.camera().start();
    rig.lamps().light(LampId{2}, 1.0);
    return rig;
}

std::vector<std::uint64_t> sequences(SimRig& rig, int frames) {
    std::vector<std::uint64_t> result;
    for (int i = 0; i < frames; ++i) result.push_back(next(rig).sequence);
    return result;
}

/// The lamps that burn after light(commanded).
std::vector<std::uint32_t> burning_after(const std::string& faults, std::uint32_t commanded) {
    SimRig rig = lit_rig(faults);
    rig.lamps().light(LampId{commanded}, 1.0);
    const Interval later{rig.clock().now(), rig.clock().now() + second};
    std::vector<std::uint32_t> lamps;
    for (const LampShare& share : rig.lamps().burning_during(later)) lamps.push_back(share.lamp.value);
    return lamps;
}

TEST(Faults, AreReadFromText) {
    const FaultPlan plan = parse_faults("drop@7 hang@3x2 dead-lamp@0:4 swapped-lamps@1:2,5");
    ASSERT_EQ(plan.faults.size(), 4U);
    EXPECT_EQ(plan.faults[0].kind, FaultKind::drop);
    EXPECT_EQ(plan.faults[0].at, 7U);
    EXPECT_EQ(plan.faults[1].count, 2U);
    EXPECT_EQ(plan.faults[2].lamp, LampId{4});
    EXPECT_EQ(plan.faults[3].lamp, LampId{2});
    EXPECT_EQ(plan.faults[3].other, LampId{5});
    EXPECT_TRUE(parse_faults("").faults.empty());
}

TEST(Faults, UnreadableTextNamesTheKnownOnes) {
    for (const std::string bad : {"drop", "drop@", "melt@3", "dead-lamp@0", "drop@1:2", "swapped-lamps@0:1", "drop@-1"})
        try {
            parse_faults(bad);
            FAIL() << bad;
        } catch (const InputError& e) {
            EXPECT_NE(std::string(e.what()).find(bad), std::string::npos);
            EXPECT_NE(e.hint().find("stale-queue"), std::string::npos);
        }
}

TEST(Faults, DropLeavesAGapInTheSequence) {
    SimRig rig = lit_rig("drop@2x2");
    EXPECT_EQ(sequences(rig, 4), (std::vector<std::uint64_t>{0, 1, 4, 5}));
}

TEST(Faults, ErrorFlagMarksADamagedFrame) {
    SimRig rig = lit_rig("error-flag@1");
    SimRig sound = lit_rig("");
    EXPECT_EQ(next(rig).status, FrameStatus::good);
    next(sound);
    const Frame damaged = next(rig);
    EXPECT_EQ(damaged.status, FrameStatus::error);
    EXPECT_EQ(damaged.sequence, 1U);
    EXPECT_NE(damaged.pixels, next(sound).pixels);
    EXPECT_EQ(next(rig).status, FrameStatus::good);
}

TEST(Faults, RepeatDeliversThePictureBeforeUnderANewNumber) {
    SimRig rig = lit_rig("repeat@2");
    next(rig);
    const Frame before = next(rig);
    const Frame repeated = next(rig);
    const Frame after = next(rig);
    EXPECT_EQ(repeated.sequence, before.sequence + 1);
    EXPECT_GT(repeated.timestamp, before.timestamp);
    EXPECT_EQ(repeated.pixels, before.pixels);
    EXPECT_NE(after.pixels, before.pixels);
}

TEST(Faults, ARepeatedPictureIsTheOldLampsPicture) {
    SimRig rig = lit_rig("repeat@3");
    for (int i = 0; i < 3; ++i) next(rig);
    rig.lamps().dark();
    next(rig);
    ASSERT_EQ(rig.camera().exposures().back().sequence, 3U);
    EXPECT_EQ(rig.camera().exposures().back().lamps.size(), 1U) << "the lamp was lit when the picture was made";
}

TEST(Faults, StaleQueueDeliversAnOldFrameWithItsOwnOldTimestamp) {
    SimRig rig = lit_rig("stale-queue@5");
    for (int i = 0; i < 4; ++i) next(rig);
    const Frame good = next(rig);
    const Frame stale = next(rig);
    EXPECT_EQ(good.sequence, 4U);
    EXPECT_EQ(stale.sequence, 2U);  // queue depth 2
    EXPECT_LT(stale.timestamp, good.timestamp);
    EXPECT_EQ(next(rig).sequence, 6U);
}

TEST(Faults, BlackFrameShowsNoLight) {
    SimRig rig = lit_rig("black-frame@1");
    EXPECT_GT(mean_signal(next(rig)), 200.0);
    EXPECT_NEAR(mean_signal(next(rig)), 0.0, 0.2);
    EXPECT_TRUE(rig.camera().exposures().back().lamps.empty());
    EXPECT_GT(mean_signal(next(rig)), 200.0);
}

TEST(Faults, HangKeepsUntilTheDeadlineAndEndsAfterItsCount) {
    SimRig rig = lit_rig("hang@1x2");
    next(rig);
    for (int i = 0; i < 2; ++i) {
        const TimePoint deadline = rig.clock().now() + second;
        EXPECT_THROW(rig.camera().next_frame(deadline), DeadlineError);
        EXPECT_EQ(rig.clock().now(), deadline);
    }
    EXPECT_NO_THROW(next(rig));
}

TEST(Faults, DeadStuckAndSwappedLampsBurnAsTheirNamesSay) {
    EXPECT_EQ(burning_after("", 1), (std::vector<std::uint32_t>{1}));
    EXPECT_EQ(burning_after("dead-lamp@0:1", 1), (std::vector<std::uint32_t>{}));
    EXPECT_EQ(burning_after("dead-lamp@0:1", 0), (std::vector<std::uint32_t>{0}));
    EXPECT_EQ(burning_after("stuck-lamp@0:0", 1), (std::vector<std::uint32_t>{0, 1}));
    EXPECT_EQ(burning_after("swapped-lamps@0:0,1", 1), (std::vector<std::uint32_t>{0}));
    EXPECT_EQ(burning_after("swapped-lamps@0:0,1", 0), (std::vector<std::uint32_t>{1}));
    EXPECT_EQ(burning_after("swapped-lamps@0:0,1", 2), (std::vector<std::uint32_t>{2}));
}

TEST(Faults, AStuckLampBurnsOnInTheDark) {
    SimRig rig = lit_rig("stuck-lamp@0:0");
    rig.lamps().dark();
    EXPECT_FALSE(rig.lamps().all_dark());
}

TEST(Faults, LampFaultsBeginAtTheirMoment) {
    EXPECT_EQ(burning_after("dead-lamp@1:1", 1), (std::vector<std::uint32_t>{}));  // lit_rig() makes call 0
    EXPECT_EQ(burning_after("dead-lamp@2:1", 1), (std::vector<std::uint32_t>{1}));
}

}  // namespace
}  // namespace darkbox::sim
