// How long until the lamps are dark, in the chip's own time, whatever goes wrong. Every line of the table has a bound.
#include <gmock/gmock.h>

#include <fmt/format.h>

#include "firmware/board/atmega32u4/eeprom_layout.h"
#include "tests/firmware/board_fixture.h"
#include "tests/firmware/emulator/emulated_host.h"

namespace darkbox {
namespace {

using namespace lamp_protocol;
using lampctl::HostBoard;
using test::EmulatedBoard;
using test::EmulatedHost;
using test::outcome;

constexpr double heartbeat_bound_ms = 150;
constexpr double watchdog_bound_ms = 300;
constexpr double at_once_ms = 2;

/// A board whose lamp 5 is lit, the heartbeat 100 ms.
class EmulatedSafety : public testing::Test {
protected:
    EmulatedSafety() {
        host.enumerate();
        host.command(Command::configure, test::configure(100, 1));
        host.command(Command::limit, test::limit(0, 64, 5000, 255));
        light();
    }
    void light() {
        ASSERT_EQ(outcome(host.command(Command::light, test::light({5}))), Outcome::done);
        ASSERT_EQ(board.lamps().lit, std::uint64_t{1} << 5);
    }
    /// The line is printed, and fails above its bound.
    void expect_dark(const std::string& what, double bound_ms) { expect_dark_since(board.now_us(), what, bound_ms); }
    void expect_dark_since(double begin, const std::string& what, double bound_ms) {
        const bool dark = board.run_until([&] { return board.lamps().lit == 0; }, 10'000);
        const double took = (board.now_us() - begin) / 1000;
        std::printf("%s\n",
                    fmt::format("{:<44} dark after {:8.3f} ms, bound {:6.0f} ms", what, took, bound_ms).c_str());
        EXPECT_TRUE(dark) << what;
        EXPECT_LE(took, bound_ms) << what;
    }
    void expect_stays_dark(double ms) {
        bool lit = false;
        board.on_lamps = [&](const test::LampsSeen& seen) { lit |= seen.lit != 0; };
        board.run_ms(ms);
        board.on_lamps = nullptr;
        EXPECT_FALSE(lit);
    }
    Event clear() { return host.command(Command::clear_faults, ClearCommand{0xFF, {}}); }

    EmulatedBoard board{DARKBOX_LAMP_ELF, HostBoard::some_identity()};
    EmulatedHost host{board};
};

TEST_F(EmulatedSafety, HostHangs) {
    expect_dark("host hangs (no packet more)", heartbeat_bound_ms);
    expect_stays_dark(500);
    EXPECT_EQ(host.status().faults, fault_host_lost);
    EXPECT_EQ(outcome(host.command(Command::light, test::light({5}))), Outcome::fault_stands);
    EXPECT_EQ(outcome(clear()), Outcome::done);
    light();
}

TEST_F(EmulatedSafety, ShortestHeartbeat) {
    host.command(Command::configure, test::configure(50, 1));
    expect_dark("host hangs, heartbeat 50 ms", 75);
}

TEST_F(EmulatedSafety, HostIsKilled) {
    // The kernel cancels the dead program's transfers and takes nothing back: to the board it is silence.
    board.run_ms(30);
    EXPECT_NE(board.lamps().lit, 0U);
    expect_dark("host killed (SIGKILL)", heartbeat_bound_ms);
}

TEST_F(EmulatedSafety, HostResetsTheBus) {
    board.bus_reset();
    expect_dark("host resets the bus", at_once_ms);
}

TEST_F(EmulatedSafety, ConfigurationIsTakenBack) {
    const double begin = board.now_us();
    host.control({0, 9, 0, 0, 0});
    expect_dark_since(begin, "configuration taken back", at_once_ms);
}

TEST_F(EmulatedSafety, CableIsPulledAndVbusFalls) {
    board.signal_unplug();
    expect_dark("cable pulled, VBUS seen to fall", at_once_ms);
}

TEST_F(EmulatedSafety, CableIsPulledAndTheBusIsSilent) {
    board.run_ms(3);  // the silicon takes 3 ms of silence for suspend
    board.signal_suspend();
    expect_dark("cable pulled, suspend seen (after its 3 ms)", at_once_ms);
}

TEST_F(EmulatedSafety, CableIsPulledAndNothingIsSeen) {
    expect_dark("cable pulled, no signal from the bus at all", heartbeat_bound_ms);
}

TEST_F(EmulatedSafety, FirmwareHangsWithInterrupts) {
    board.hang(EmulatedBoard::Interrupts::served);
    expect_dark("firmware hangs, interrupts served (watchdog)", watchdog_bound_ms);
    EXPECT_EQ(board.resets(), 1U);
    expect_stays_dark(300);
    host.enumerate();
    EXPECT_EQ(host.read<Info>(Request::info).reset_cause, reset_watchdog);
    light();
}

TEST_F(EmulatedSafety, FirmwareHangsWithoutInterrupts) {
    board.hang(EmulatedBoard::Interrupts::off);
    expect_dark("firmware hangs, interrupts off (watchdog)", watchdog_bound_ms);
    EXPECT_EQ(board.resets(), 1U);
    expect_stays_dark(300);
}

TEST_F(EmulatedSafety, TooHot) {
    board.set_thermistor(HostBoard::some_identity().hot - 10);
    expect_dark("over-temperature", 10);
    EXPECT_EQ(outcome(clear()), Outcome::fault_stands);
    board.set_thermistor(512);
    host.stay_for_ms(20);
    EXPECT_EQ(outcome(clear()), Outcome::done);
}

TEST_F(EmulatedSafety, ThermistorBreaks) {
    board.set_thermistor(1023);
    expect_dark("thermistor broken or unplugged", 10);
}

TEST_F(EmulatedSafety, CommandIsStuckOn) {
    host.command(Command::dark);
    host.command(Command::limit, test::limit(5, 1, 200, 64));
    const double begin = board.now_us();
    bool dark = false;
    light();
    while (!dark && board.now_us() < begin + 1e6) {
        host.command(Command::light, test::light({5}));
        dark = board.lamps().lit == 0;
    }
    const double took = (board.now_us() - begin) / 1000;
    std::printf("%s\n", fmt::format("{:<44} dark after {:8.3f} ms, bound {:6.0f} ms", "stuck-on command, max_on 200 ms",
                                    took, 200.0 + at_once_ms)
                            .c_str());
    EXPECT_TRUE(dark);
    EXPECT_LE(took, 200 + at_once_ms);
    EXPECT_EQ(host.status().faults, fault_on_too_long);
}

TEST_F(EmulatedSafety, BrownOut) {
    board.brown_out();
    expect_dark("brown-out reset", at_once_ms);
    expect_stays_dark(300);
    host.enumerate();
    EXPECT_EQ(host.read<Info>(Request::info).reset_cause, reset_brown_out);
}

TEST_F(EmulatedSafety, CorruptPackets) {
    const LightCommand other = test::light({6});
    const auto good = lampctl::packet_of(Command::light, 1, &other, sizeof other);
    const double begin = board.now_us();
    // All one-bit errors, as fast as the bus takes them; they are no heartbeat, and light nothing.
    for (std::size_t bit = 0; board.lamps().lit != 0 && board.now_us() < begin + 1e6; ++bit) {
        auto broken = good;
        broken[bit / 8 % broken.size()] ^= static_cast<std::uint8_t>(1U << bit % 8);
        host.out(command_endpoint, broken);
        ASSERT_EQ(board.lamps().lit & ~(std::uint64_t{1} << 5), 0U);
        board.run_us(500);
    }
    const double took = (board.now_us() - begin) / 1000;
    std::printf("%s\n", fmt::format("{:<44} dark after {:8.3f} ms, bound {:6.0f} ms", "nothing but corrupt packets",
                                    took, heartbeat_bound_ms)
                            .c_str());
    EXPECT_LE(took, heartbeat_bound_ms);
}

TEST_F(EmulatedSafety, IntoTheBootloader) {
    const auto request = static_cast<std::uint8_t>(Request::bootloader);
    EXPECT_EQ(host.control({EmulatedHost::vendor_out, request, 0, 0, 0}).handshake, EmulatedBoard::Handshake::stall);
    const double begin = board.now_us();
    EXPECT_EQ(host.control({EmulatedHost::vendor_out, request, bootloader_key, 0, 0}).handshake,
              EmulatedBoard::Handshake::ack);
    expect_dark_since(begin, "sent into the bootloader", at_once_ms);
    EXPECT_TRUE(board.run_until([&] { return board.in_bootloader(); }, 500));
    EXPECT_FALSE(board.supply_on());
    EXPECT_FALSE(board.attached());
}

TEST(EmulatedStart, RegistersWakeUpRandomAndNothingShines) {
    EmulatedBoard board(DARKBOX_LAMP_ELF, HostBoard::some_identity());
    bool lit = false;
    board.on_lamps = [&](const test::LampsSeen& seen) { lit |= seen.lit != 0; };
    board.run_ms(200);
    EXPECT_FALSE(lit);
    EXPECT_TRUE(board.supply_on());
}

TEST(EmulatedStart, CorruptEepromLightsNothing) {
    const auto identity = HostBoard::some_identity();
    const auto* bytes = reinterpret_cast<const std::uint8_t*>(&identity);
    std::printf("%s\n", fmt::format("{:<44} never lit; erased, and each of 48 bytes wrong", "corrupt EEPROM").c_str());
    for (int wrong = -1; wrong < 48; ++wrong) {
        EmulatedBoard board(DARKBOX_LAMP_ELF, std::nullopt);
        if (wrong >= 0) {
            std::vector<std::uint8_t> stored(bytes, bytes + 48);
            stored[static_cast<std::size_t>(wrong)] ^= 0x10;
            board.write_eeprom(board::identity_address, stored);
        }
        bool lit = false;
        board.on_lamps = [&](const test::LampsSeen& seen) { lit |= seen.lit != 0; };
        EmulatedHost host(board);
        host.enumerate();
        EXPECT_EQ(host.status().faults, fault_identity);
        EXPECT_EQ(outcome(host.command(Command::light, test::light({0}))), Outcome::fault_stands);
        host.command(Command::clear_faults, ClearCommand{0xFF, {}});
        EXPECT_EQ(outcome(host.command(Command::light, test::light({0}))), Outcome::fault_stands);
        EXPECT_FALSE(lit) << "byte " << wrong;
        EXPECT_FALSE(board.supply_on());
    }
}

}  // namespace
}  // namespace darkbox
