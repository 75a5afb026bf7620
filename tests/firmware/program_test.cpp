#include <gmock/gmock.h>

#include "tests/firmware/board_fixture.h"

namespace darkbox {
namespace {

using namespace lamp_protocol;
using lampctl::HostBoard;
using lampctl::LampSet;
using test::outcome;
using test::step;

/// The lamps' switches of a program, each with its time since the program began.
class LampProgram : public testing::Test {
protected:
    struct Switch {
        std::uint64_t at_us;
        int lamp;  ///< -1: dark
    };

    LampProgram() {
        board.on_show = [this](const LampSet& lamps, std::uint8_t) {
            int lamp = -1;
            for (std::uint8_t i = 0; i < most_lamps; ++i)
                if (lamps.has(i)) lamp = i;
            switches.push_back({board.now_us() - begin, lamp});
        };
        board.on_trigger = [this](bool active) {
            if (active) triggers.push_back(board.now_us() - begin);
        };
    }
    Outcome run(const std::vector<Step>& steps, std::uint16_t rounds = 1) {
        test::write_program(board, steps);
        const Outcome got = outcome(board.command(Command::run_program, test::run_command(steps, rounds)));
        switches.clear();
        if (got == Outcome::done) board.run_us(program_starts_after_us);
        begin = board.now_us();
        for (Switch& first : switches) first.at_us = 0;
        return got;
    }
    std::vector<Event> steps_done() {
        board.fetch_events();
        return test::of_kind(board.events, EventKind::step);
    }
    /// With the host's heartbeat and its polls.
    void pass_ms(int ms) {
        for (; ms > 0; --ms) {
            board.run_ms(1);
            if (ms % 40 == 0) board.command(Command::heartbeat);
            board.fetch_events();
        }
    }

    HostBoard board;
    std::uint64_t begin = 0;
    std::vector<Switch> switches;
    std::vector<std::uint64_t> triggers;
};

TEST_F(LampProgram, StepsFollowEachOtherToTheMicrosecond) {
    ASSERT_EQ(run({step(3, 1234, 5001), step(9, 17, 2003, step_trigger), step(0, 0, 50)}), Outcome::done);
    pass_ms(20);
    ASSERT_EQ(switches.size(), 4U);
    EXPECT_EQ(switches[0].lamp, 3);
    EXPECT_EQ(switches[1].at_us, 1234U + 5001);
    EXPECT_EQ(switches[1].lamp, 9);
    EXPECT_EQ(switches[2].at_us, 6235U + 17 + 2003);
    EXPECT_EQ(switches[3].at_us, 8255U + 50);
    EXPECT_EQ(switches[3].lamp, -1);
    EXPECT_EQ(triggers, (std::vector<std::uint64_t>{6235 + 17}));
    const auto done = steps_done();
    ASSERT_EQ(done.size(), 3U);
    EXPECT_EQ(done[1].time_us - done[0].time_us, 5001U + 17) << "exposure to exposure";
    EXPECT_EQ(done[1].value, 2003U);
    EXPECT_EQ(done[1].lamp, 9);
    EXPECT_EQ(test::of_kind(board.events, EventKind::program_done).size(), 1U);
    EXPECT_EQ(board.status().activity, Activity::dark);
}

TEST_F(LampProgram, SixtyFourStepsTwiceKeepTime) {
    std::vector<Step> steps;
    for (std::uint8_t lamp = 0; lamp < 64; ++lamp) steps.push_back(step(lamp, 300, 700));
    ASSERT_EQ(run(steps, 2), Outcome::done);
    pass_ms(200);
    ASSERT_EQ(switches.size(), 129U);
    for (std::size_t i = 0; i < switches.size(); ++i) EXPECT_EQ(switches[i].at_us, i * 1000);
    EXPECT_EQ(steps_done().size(), 128U);
    EXPECT_EQ(steps_done().back().round, 1);
}

TEST_F(LampProgram, AStepWaitsForTheStrobeOfASettledLamp) {
    ASSERT_EQ(run({step(1, 2000, 8000, step_wait_strobe), step(2, 2000, 8000, step_wait_strobe)}), Outcome::done);
    pass_ms(1);
    board.strobe();  // the lamp is not settled: this exposure is no good
    pass_ms(9);
    EXPECT_EQ(switches.size(), 1U);
    board.run_us(500);
    board.strobe();
    pass_ms(8);
    ASSERT_EQ(switches.size(), 2U);
    EXPECT_EQ(switches[1].at_us, 10'500U + 8000);
    const auto done = steps_done();
    ASSERT_EQ(done.size(), 1U);
    EXPECT_EQ(done[0].value, 8000U);
}

TEST_F(LampProgram, AStrobeThatStaysOutEndsIt) {
    board.command(Command::limit, test::limit(0, 64, 100));
    ASSERT_EQ(run({step(1, 2000, 8000, step_wait_strobe)}), Outcome::done);
    pass_ms(101);
    EXPECT_TRUE(board.lit().empty());
    EXPECT_EQ(board.status().faults, fault_strobe);
    board.command(Command::clear_faults, ClearCommand{0xFF, {}});
    ASSERT_EQ(run({step(1, 0, 8000, step_wait_strobe, 0)}), Outcome::done);
    pass_ms(10'002);
    EXPECT_EQ(board.status().faults, fault_strobe) << "a dark frame waits 10 s";
}

TEST_F(LampProgram, ADarkStepLightsNothing) {
    ASSERT_EQ(run({step(1, 0, 1000), step(1, 0, 1000, 0, 0), step(2, 0, 1000)}), Outcome::done);
    pass_ms(5);
    ASSERT_EQ(switches.size(), 4U);
    EXPECT_EQ(switches[1].lamp, -1);
    EXPECT_EQ(steps_done()[1].lamp, no_lamp);
}

TEST_F(LampProgram, HalfAProgramNeverRuns) {
    const std::vector<Step> steps{step(1, 0, 1000), step(2, 0, 1000)};
    test::write_program(board, {steps[0]});
    EXPECT_EQ(outcome(board.command(Command::run_program, test::run_command(steps))), Outcome::other_program);
    EXPECT_TRUE(board.lit().empty());
}

TEST_F(LampProgram, StepsBeyondTheRangesAreRefused) {
    board.command(Command::limit, test::limit(0, 64, 100));
    EXPECT_EQ(run({step(1, 50'000, 50'000)}), Outcome::step_too_long);
    EXPECT_EQ(run({step(1, 0, 49)}), Outcome::out_of_range);
    EXPECT_EQ(run({step(1, 50'000, 49'000)}), Outcome::done);
    board.command(Command::dark);
    EXPECT_EQ(run({step(1, 0, 1000)}, 0), Outcome::out_of_range);
    Identity identity = HostBoard::some_identity();
    identity.lamps = 8;
    board.identify(lampctl::sealed(identity));
    EXPECT_EQ(run({step(8, 0, 1000)}), Outcome::no_such_lamp);
    EXPECT_TRUE(board.lit().empty());
}

TEST_F(LampProgram, WhileItRunsOnlyHeartbeatAndDarkAreTaken) {
    ASSERT_EQ(run({step(1, 0, 500'000)}), Outcome::done);
    EXPECT_EQ(outcome(board.command(Command::light, test::light({2}))), Outcome::program_runs);
    EXPECT_EQ(outcome(board.command(Command::configure, test::configure(1000, 2))), Outcome::program_runs);
    EXPECT_EQ(outcome(board.command(Command::heartbeat)), Outcome::done);
    EXPECT_EQ(board.status().activity, Activity::program);
    EXPECT_EQ(outcome(board.command(Command::dark)), Outcome::done);
    EXPECT_TRUE(board.lit().empty());
    EXPECT_FALSE(board.triggered());
    pass_ms(600);
    EXPECT_TRUE(steps_done().empty());
}

TEST_F(LampProgram, RoundsThatUseUpALampEndInAFault) {
    board.command(Command::limit, test::limit(0, 64, 100, 16));
    ASSERT_EQ(run({step(1, 0, 30'000), step(2, 0, 5'000)}, 1000), Outcome::done);
    pass_ms(3000);
    EXPECT_EQ(board.status().faults, fault_on_too_long);
    EXPECT_TRUE(board.lit().empty());
}

}  // namespace
}  // namespace darkbox
