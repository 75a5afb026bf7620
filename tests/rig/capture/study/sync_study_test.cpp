#include "tests/rig/capture/study/sync_study.h"

#include <gtest/gtest.h>

namespace darkbox::test {
namespace {

/// A bounded part of the synchronisation study; ./run sync-study is the whole.
class SyncStudy : public testing::Test {
protected:
    static void SetUpTestSuite() { rows = run_study(12'000, 2, 100'001); }
    static std::vector<StudyRow> rows;
};
std::vector<StudyRow> SyncStudy::rows;

TEST_F(SyncStudy, AcceptsNoFrameOfAnotherLamp) {
    std::size_t lights = 0;
    for (const StudyRow& row : rows) {
        EXPECT_EQ(row.tally.wrong, 0) << table({row});
        EXPECT_EQ(row.tally.foreign, 0) << table({row});
        lights += row.tally.lights;
    }
    EXPECT_GT(lights, 9'000);
}

TEST_F(SyncStudy, RejectsNextToNothingOfAnHonestCamera) {
    for (const StudyRow& row : rows) {
        if (row.lie != Lie::none) continue;
        EXPECT_EQ(row.tally.failed, 0) << table({row});
        EXPECT_LE(100 * row.tally.rejected, row.tally.lights) << table({row});
    }
}

TEST_F(SyncStudy, IsAsFastAsEachModePromises) {
    for (const StudyRow& row : rows) {
        if (row.lie != Lie::none) continue;
        EXPECT_GE(row.tally.at_the_aim(row.mode), 0.95) << table({row});
        EXPECT_GT(row.tally.speed.size(), row.tally.sessions / 2) << table({row});
    }
}

TEST_F(SyncStudy, IsTheSameOnAnyNumberOfThreads) {
    EXPECT_EQ(table(run_study(1'500, 1, 7)), table(run_study(1'500, 3, 7)));
}

/// The switch in the gap is the point of predictive mode: a camera with plenty of gap loses no frame to the switches.
TEST(PredictiveMode, TakesAFrameALamp) {
    StudyCase c;
    c.exposure = 0.6 * c.period;
    c.latency = 3;
    const StudyTally tally = study_session(c, SyncMode::predictive);
    EXPECT_EQ(tally.lights, c.lamps);
    EXPECT_EQ(tally.unfit, 0);
    EXPECT_GE(tally.speed.at(0), 0.95);
}

/// The first switch of all, the one between two blocks of 64 lamps, and the last are witnesses.
class LateWitness : public testing::TestWithParam<int> {};

/// A busy host may switch so late that the frame to be spoiled was exposed by then, or so slowly that nobody knows
/// when.
TEST_P(LateWitness, IsTriedAgain) {
    for (const double stall : {0.1, 0.3, 0.7, 1.5}) {
        StudyCase c;
        c.exposure = 0.6 * c.period;
        c.latency = 3;
        c.lamps = 100;
        c.stalled = {GetParam()};
        c.stall = stall * c.period;
        const StudyTally tally = study_session(c, SyncMode::predictive);
        EXPECT_EQ(tally.lights, c.lamps);
        EXPECT_EQ(tally.wrong + tally.foreign, 0);
        EXPECT_EQ(tally.rejected, 0) << stall;
        EXPECT_GE(tally.speed.at(0), 0.9) << stall;
    }
}

INSTANTIATE_TEST_SUITE_P(PredictiveMode, LateWitness, testing::Values(0, 64, 100));

/// Three late ones in a row: the block is taken again, settled.
TEST(PredictiveMode, GivesUpAWitnessThatIsAlwaysLate) {
    StudyCase c;
    c.exposure = 0.6 * c.period;
    c.stalled = {0, 2, 4};  // between them, darkness again
    c.stall = 0.7 * c.period;
    const StudyTally tally = study_session(c, SyncMode::predictive);
    EXPECT_EQ(tally.lights, c.lamps);
    EXPECT_EQ(tally.wrong + tally.foreign, 0);
    EXPECT_EQ(tally.rejected, 64);
}

TEST(PredictiveMode, SaysSoWhenTheGapIsTooShort) {
    StudyCase c;
    c.exposure = 0.9 * c.period;
    c.readout = 0.5 * c.period;
    const StudyTally tally = study_session(c, SyncMode::predictive);
    EXPECT_EQ(tally.lights, c.lamps) << "settled mode takes over";
    EXPECT_EQ(tally.unfit, 1);
    EXPECT_EQ(tally.wrong, 0);
}

TEST(StrobedMode, NeedsNoRoomForTheHostsJitter) {
    StudyCase c;
    c.exposure = 0.9 * c.period;
    const StudyTally tally = study_session(c, SyncMode::strobed);
    EXPECT_EQ(tally.unfit, 0);
    EXPECT_EQ(tally.wrong + tally.foreign, 0);
    EXPECT_GE(tally.speed.at(0), 0.95);
}

}  // namespace
}  // namespace darkbox::test
