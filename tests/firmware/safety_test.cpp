#include <gmock/gmock.h>

#include "tests/firmware/board_fixture.h"

namespace darkbox {
namespace {

using namespace lamp_protocol;
using lampctl::HostBoard;
using test::outcome;

class LampSafety : public testing::Test {
protected:
    /// How long until the lamps are dark, the host saying nothing.
    std::uint64_t ms_to_dark(std::uint64_t most = 20'000) {
        std::uint64_t ms = 0;
        for (; !board.lit().empty() && ms < most; ++ms) board.run_ms(1);
        return ms;
    }
    std::uint64_t ms_to_dark_with_heartbeats(std::uint64_t most = 20'000) {
        std::uint64_t ms = 0;
        for (; !board.lit().empty() && ms < most; ++ms) {
            board.run_ms(1);
            if (ms % 20 == 0) board.command(Command::heartbeat);
        }
        return ms;
    }
    HostBoard board;
};

TEST_F(LampSafety, SilenceDarkens) {
    for (const int heartbeat : {50, 100, 1000}) {
        board.command(Command::configure, test::configure(static_cast<std::uint16_t>(heartbeat), 1));
        board.command(Command::limit, test::limit(0, 64, 5000, 255));
        ASSERT_EQ(outcome(board.command(Command::light, test::light({5}))), Outcome::done);
        EXPECT_NEAR(static_cast<double>(ms_to_dark()), heartbeat, 1);
        EXPECT_EQ(board.status().faults, fault_host_lost);
        EXPECT_EQ(outcome(board.command(Command::light, test::light({5}))), Outcome::fault_stands);
        EXPECT_EQ(outcome(board.command(Command::clear_faults, ClearCommand{0xFF, {}})), Outcome::done);
    }
}

TEST_F(LampSafety, SilenceInTheDarkIsNoFault) {
    board.run_ms(5000);
    EXPECT_EQ(board.status().faults, 0);
}

TEST_F(LampSafety, SilenceEndsAProgram) {
    board.command(Command::configure, test::configure(50, 1));
    const std::vector<Step> steps{test::step(1, 0, 20'000), test::step(2, 0, 20'000)};
    test::write_program(board, steps);
    ASSERT_EQ(outcome(board.command(Command::run_program, test::run_command(steps, 100))), Outcome::done);
    board.run_ms(60);
    EXPECT_TRUE(board.lit().empty());
    EXPECT_EQ(board.status().activity, Activity::dark);
    EXPECT_EQ(board.status().faults, fault_host_lost);
}

TEST_F(LampSafety, AStuckCommandIsEndedByTheBudget) {
    board.command(Command::limit, test::limit(7, 1, 120));
    board.command(Command::light, test::light({7}));
    const auto ms = ms_to_dark_with_heartbeats();
    EXPECT_LE(ms, 120U);
    EXPECT_GE(ms, 118U);
    EXPECT_EQ(board.status().faults, fault_on_too_long);
    board.fetch_events();
    const auto faults = test::of_kind(board.events, EventKind::fault);
    ASSERT_EQ(faults.size(), 1U);
    EXPECT_EQ(faults[0].lamp, 7);
}

TEST_F(LampSafety, LightingAgainRenewsNothing) {
    board.command(Command::limit, test::limit(7, 1, 120));
    board.command(Command::light, test::light({7}));
    for (int ms = 0; ms < 130; ++ms) {
        board.run_ms(1);
        board.command(Command::light, test::light({7}, static_cast<std::uint8_t>(ms + 1)));
    }
    EXPECT_TRUE(board.lit().empty());
}

TEST_F(LampSafety, ARestingLampIsRefusedAndSaysForHowLong) {
    board.command(Command::limit, test::limit(7, 1, 120, 32));
    board.command(Command::light, test::light({7}));
    ms_to_dark_with_heartbeats();
    board.command(Command::clear_faults, ClearCommand{0xFF, {}});
    const Event refused = board.command(Command::light, test::light({7}));
    ASSERT_EQ(outcome(refused), Outcome::lamp_rests);
    EXPECT_EQ(outcome(board.command(Command::light, test::light({8}))), Outcome::done) << "others may burn";
    board.command(Command::dark);
    board.run_ms(refused.value);
    EXPECT_EQ(outcome(board.command(Command::light, test::light({7}))), Outcome::done);
}

TEST_F(LampSafety, HeatDarkensUntilItIsCooler) {
    board.command(Command::light, test::light({1}));
    board.thermistor = 199;
    EXPECT_LE(ms_to_dark_with_heartbeats(), 5U);
    EXPECT_EQ(board.status().faults, fault_too_hot);
    board.thermistor = 220;
    board.run_ms(10);
    EXPECT_EQ(outcome(board.command(Command::clear_faults, ClearCommand{0xFF, {}})), Outcome::fault_stands);
    board.thermistor = 250;
    board.run_ms(10);
    EXPECT_EQ(outcome(board.command(Command::clear_faults, ClearCommand{0xFF, {}})), Outcome::done);
    EXPECT_EQ(outcome(board.command(Command::light, test::light({1}))), Outcome::done);
}

TEST_F(LampSafety, OneNoisyReadingIsNoHeat) {
    board.command(Command::light, test::light({1}));
    for (int i = 0; i < 20; ++i) {
        board.thermistor = 0;
        board.run_ms(3);
        board.thermistor = 512;
        board.run_ms(1);
    }
    EXPECT_FALSE(board.lit().empty());
}

TEST_F(LampSafety, AMissingThermistorDarkens) {
    board.command(Command::light, test::light({1}));
    board.thermistor = 1023;
    EXPECT_LE(ms_to_dark_with_heartbeats(), 5U);
    EXPECT_EQ(board.status().faults, fault_sensor);
}

TEST_F(LampSafety, AHostThatGoesLeavesDarkness) {
    board.command(Command::light, test::light({1}));
    board.host_gone();
    EXPECT_TRUE(board.lit().empty());
    EXPECT_EQ(board.status().faults, fault_host_lost);
}

TEST_F(LampSafety, WithoutAnIdentityNothingLights) {
    Identity identity = HostBoard::some_identity();
    identity.crc ^= 1;
    HostBoard nobody(identity);
    EXPECT_EQ(nobody.status().faults, fault_identity);
    EXPECT_EQ(outcome(nobody.command(Command::light, test::light({0}))), Outcome::fault_stands);
    nobody.command(Command::clear_faults, ClearCommand{0xFF, {}});
    EXPECT_EQ(nobody.status().faults, fault_identity);
    nobody.identify(HostBoard::some_identity());
    EXPECT_EQ(outcome(nobody.command(Command::light, test::light({0}))), Outcome::done);
    nobody.identify(identity);
    EXPECT_TRUE(nobody.lit().empty()) << "an identity that goes bad darkens";
}

}  // namespace
}  // namespace darkbox
