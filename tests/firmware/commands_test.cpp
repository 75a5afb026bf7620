#include <gmock/gmock.h>

#include "tests/firmware/board_fixture.h"

namespace darkbox {
namespace {

using namespace lamp_protocol;
using lampctl::HostBoard;
using test::outcome;

TEST(LampCommands, LightShowsTheseLampsAndNoOthers) {
    HostBoard board;
    EXPECT_EQ(outcome(board.command(Command::light, test::light({63}, 10))), Outcome::done);
    EXPECT_TRUE(board.lit().has(63));
    EXPECT_EQ(board.level(), 10);
    EXPECT_EQ(outcome(board.command(Command::light, test::light({0}))), Outcome::done);
    EXPECT_TRUE(board.lit().has(0));
    EXPECT_EQ(board.lit().count(), 1);
    EXPECT_EQ(outcome(board.command(Command::dark)), Outcome::done);
    EXPECT_TRUE(board.lit().empty());
}

TEST(LampCommands, ReplyRepeatsTheSequenceAndCountsEvents) {
    HostBoard board;
    const Event first = board.command(Command::heartbeat);
    const Event second = board.command(Command::heartbeat);
    EXPECT_EQ(second.sequence, first.sequence + 1);
    EXPECT_EQ(second.number, first.number + 1);
    EXPECT_EQ(second.kind, EventKind::reply);
}

TEST(LampCommands, BrokenPacketsChangeNothing) {
    HostBoard board;
    const LightCommand lamp = test::light({3});
    const auto packet = lampctl::packet_of(Command::light, 1, &lamp, sizeof lamp);
    for (std::size_t bit = 0; bit < packet.size() * 8; ++bit) {
        auto broken = packet;
        broken[bit / 8] ^= static_cast<std::uint8_t>(1U << bit % 8);
        board.receive(broken);
        EXPECT_TRUE(board.lit().empty()) << "bit " << bit;
        board.fetch_events();
        EXPECT_EQ(outcome(board.events.back()), Outcome::bad_crc);
    }
    for (std::size_t size = 0; size < packet.size(); ++size) {
        board.receive({packet.begin(), packet.begin() + static_cast<std::ptrdiff_t>(size)});
        EXPECT_TRUE(board.lit().empty()) << size << " bytes";
    }
    auto longer = packet;
    longer.push_back(0);
    board.receive(longer);
    EXPECT_TRUE(board.lit().empty());
}

TEST(LampCommands, BrokenPacketsAreNoHeartbeat) {
    HostBoard board;
    board.command(Command::configure, test::configure(50, 1));
    board.command(Command::light, test::light({3}));
    auto broken = lampctl::packet_of(Command::heartbeat, 1, nullptr, 0);
    broken[2] ^= 1;
    for (int i = 0; i < 6; ++i) {
        board.run_ms(10);
        board.receive(broken);
    }
    EXPECT_TRUE(board.lit().empty());
    EXPECT_EQ(board.status().faults, fault_host_lost);
}

TEST(LampCommands, EveryLengthIsChecked) {
    HostBoard board;
    const std::uint8_t zeros[60] = {};
    for (int command = 0; command < 256; ++command)
        for (std::size_t size = 0; size <= sizeof zeros; ++size) {
            const auto name = static_cast<Command>(command);
            const Outcome got = outcome(board.command(name, zeros, size));
            switch (name) {
                case Command::heartbeat:
                case Command::dark:
                    EXPECT_EQ(got == Outcome::done, size == 0);
                    break;
                case Command::light:
                    EXPECT_EQ(got == Outcome::bad_length, size != 12);
                    break;
                case Command::limit:
                case Command::run_program:
                    EXPECT_EQ(got == Outcome::bad_length, size != 8);
                    break;
                case Command::configure:
                case Command::clear_faults:
                    EXPECT_EQ(got == Outcome::bad_length, size != 4);
                    break;
                case Command::write_steps:
                    EXPECT_EQ(got == Outcome::bad_length, size != 4);
                    break;
                default:
                    EXPECT_EQ(got, Outcome::unknown_command) << command;
            }
        }
    EXPECT_TRUE(board.lit().empty());
}

TEST(LampCommands, LampsThatAreNotThereOrTooManyAreRefused) {
    Identity identity = HostBoard::some_identity();
    identity.lamps = 20;
    HostBoard board(lampctl::sealed(identity));
    EXPECT_EQ(outcome(board.command(Command::light, test::light({20}))), Outcome::no_such_lamp);
    EXPECT_EQ(outcome(board.command(Command::light, test::light({1, 2}))), Outcome::too_many_lit);
    EXPECT_EQ(outcome(board.command(Command::light, test::light({}))), Outcome::out_of_range);
    EXPECT_EQ(outcome(board.command(Command::light, test::light({1}, 0))), Outcome::out_of_range);
    EXPECT_EQ(outcome(board.command(Command::configure, test::configure(1000, 3))), Outcome::out_of_range);
    EXPECT_EQ(outcome(board.command(Command::configure, test::configure(1000, 2))), Outcome::done);
    EXPECT_EQ(outcome(board.command(Command::light, test::light({1, 2}))), Outcome::done);
    EXPECT_EQ(board.lit().count(), 2);
    EXPECT_EQ(outcome(board.command(Command::configure, test::configure(1000, 1))), Outcome::done);
    EXPECT_TRUE(board.lit().empty()) << "two were lit where one is allowed now";
}

TEST(LampCommands, SettingsOutOfRangeAreRefused) {
    HostBoard board;
    for (const int heartbeat : {0, 49, 1001, 65535})
        EXPECT_EQ(outcome(board.command(Command::configure, test::configure(static_cast<std::uint16_t>(heartbeat), 1))),
                  Outcome::out_of_range);
    EXPECT_EQ(outcome(board.command(Command::configure, test::configure(50, 0))), Outcome::out_of_range);
    EXPECT_EQ(outcome(board.command(Command::limit, test::limit(64, 1, 10))), Outcome::no_such_lamp);
    EXPECT_EQ(outcome(board.command(Command::limit, test::limit(60, 5, 10))), Outcome::out_of_range);
    EXPECT_EQ(outcome(board.command(Command::limit, test::limit(0, 0, 10))), Outcome::out_of_range);
    EXPECT_EQ(outcome(board.command(Command::limit, test::limit(0, 1, 0))), Outcome::out_of_range);
    EXPECT_EQ(outcome(board.command(Command::limit, test::limit(0, 1, 5001))), Outcome::out_of_range);
    EXPECT_EQ(outcome(board.command(Command::limit, test::limit(0, 1, 10, 0))), Outcome::out_of_range);
    EXPECT_EQ(outcome(board.command(Command::limit, test::limit(0, 64, 5000, 255))), Outcome::done);
}

TEST(LampCommands, AFullQueueLosesEventsAndSaysSo) {
    HostBoard board;
    const auto packet = lampctl::packet_of(Command::heartbeat, 1, nullptr, 0);
    for (int i = 0; i < 11; ++i) board.receive(packet);
    board.fetch_events();
    EXPECT_EQ(board.events.size(), 8U);
    EXPECT_EQ(board.status().events_lost, 3);
    board.receive(packet);
    board.fetch_events();
    EXPECT_EQ(board.events.back().number, 11) << "the gap shows";
}

}  // namespace
}  // namespace darkbox
