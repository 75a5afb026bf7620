// Programs on the image that is flashed, in the chip's own microseconds.
#include <gmock/gmock.h>

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "tests/firmware/board_fixture.h"
#include "tests/firmware/emulator/emulated_host.h"

namespace darkbox {
namespace {

using namespace lamp_protocol;
using lampctl::HostBoard;
using test::EmulatedBoard;
using test::EmulatedHost;
using test::outcome;
using test::step;

class EmulatedTiming : public testing::Test {
protected:
    struct Switch {
        double at_us;
        std::uint64_t lit;
    };

    EmulatedTiming() {
        host.enumerate();
        host.command(Command::configure, test::configure(1000, 1));
        board.on_lamps = [this](const test::LampsSeen& seen) {
            if (seen.lit != 0) switches.push_back({board.now_us(), seen.lit});
        };
        board.on_trigger = [this](bool active) { triggers.push_back({board.now_us(), active ? 1U : 0U}); };
    }
    void start(const std::vector<Step>& steps, std::uint16_t rounds = 1) {
        for (const auto& payload : test::upload(steps))
            ASSERT_EQ(outcome(host.command(Command::write_steps, payload.data(), payload.size())), Outcome::done);
        switches.clear();
        ASSERT_EQ(outcome(host.command(Command::run_program, test::run_command(steps, rounds))), Outcome::done);
    }
    std::vector<Event> steps_done() const { return test::of_kind(host.events, EventKind::step); }

    EmulatedBoard board{DARKBOX_LAMP_ELF, HostBoard::some_identity()};
    EmulatedHost host{board};
    std::vector<Switch> switches;
    std::vector<Switch> triggers;
};

TEST_F(EmulatedTiming, StepsOfSixtyFourLampsKeepTheirMicroseconds) {
    constexpr std::uint32_t lead_us = 2000, exposure_us = 6000;
    std::vector<Step> steps;
    for (std::uint8_t lamp = 0; lamp < 64; ++lamp) steps.push_back(step(lamp, lead_us, exposure_us, step_trigger));
    start(steps);
    host.stay_for_ms(64 * 8 + 5);  // with heartbeats, replies and events under way
    ASSERT_EQ(switches.size(), 64U);
    // The first lamp comes out of the dark, by a shorter way than those that follow another.
    EXPECT_NEAR(switches[1].at_us - switches[0].at_us, lead_us + exposure_us, 20);
    double worst_us = 0;
    for (std::size_t i = 2; i < switches.size(); ++i) {
        EXPECT_EQ(switches[i].lit, std::uint64_t{1} << i);
        worst_us = std::max(worst_us, std::abs(switches[i].at_us - switches[i - 1].at_us - lead_us - exposure_us));
    }
    double worst_trigger_us = 0;
    ASSERT_EQ(triggers.size(), 128U);
    for (std::size_t i = 2; i < triggers.size(); ++i)
        worst_trigger_us =
            std::max(worst_trigger_us, std::abs(triggers[i].at_us - triggers[i - 2].at_us - lead_us - exposure_us));
    const double drift_us = switches.back().at_us - switches[1].at_us - 62.0 * (lead_us + exposure_us);
    std::printf("%s\n",
                fmt::format("64 steps of {} us: jitter of the lamps {:.2f} us, of the trigger {:.2f} us, over all "
                            "{:.2f} us",
                            lead_us + exposure_us, worst_us, worst_trigger_us, drift_us)
                    .c_str());
    EXPECT_LE(worst_us, 5);
    EXPECT_LE(worst_trigger_us, 5);
    EXPECT_LE(std::abs(drift_us), 5);
    const auto done = steps_done();
    ASSERT_EQ(done.size(), 64U);
    for (std::size_t i = 1; i < done.size(); ++i)
        EXPECT_EQ(done[i].time_us - done[i - 1].time_us, lead_us + exposure_us);
    EXPECT_EQ(host.status().events_lost, 0);
}

TEST_F(EmulatedTiming, CommandsPerSecond) {
    // A host that polls the event endpoint each millisecond, as bInterval asks, and sends when the reply is there.
    const double begin = board.now_us();
    constexpr int commands = 200;
    double worst_us = 0;
    for (int i = 0; i < commands; ++i) {
        const double sent = board.now_us();
        const LightCommand light = test::light({static_cast<unsigned>(i) % 64});
        host.out(command_endpoint,
                 lampctl::packet_of(Command::light, static_cast<std::uint8_t>(i), &light, sizeof light));
        const std::uint64_t wanted = std::uint64_t{1} << i % 64;
        ASSERT_TRUE(board.run_until([&] { return board.lamps().lit == wanted; }, 20));
        worst_us = std::max(worst_us, board.now_us() - sent);
        const double frame = 1000 - std::fmod(board.now_us(), 1000);
        board.run_us(frame);
        ASSERT_TRUE(host.next_event(20));
    }
    const double rate = commands / (board.now_us() - begin) * 1e6;
    std::printf("%s\n",
                fmt::format("host commands: {:.0f} a second with a reply each; from packet to light at most {:.0f} us",
                            rate, worst_us)
                    .c_str());
    EXPECT_GE(rate, 400);
    EXPECT_LE(worst_us, 1500);
}

/// A camera that runs freely: its strobe is up while it exposes.
class Strobed : public EmulatedTiming, public testing::WithParamInterface<double> {};

TEST_P(Strobed, EveryFrameShowsOneLampAndNoFrameIsLost) {
    const double period_us = 1e6 / GetParam();
    const double exposure_us = period_us * 0.8;
    std::vector<Step> steps;
    const auto lead = static_cast<std::uint32_t>(period_us * 0.1);
    for (std::uint8_t lamp = 0; lamp < 64; ++lamp)
        steps.push_back(step(lamp, lead, static_cast<std::uint32_t>(exposure_us), step_wait_strobe));
    start(steps);
    const double begin = board.now_us();
    std::vector<double> exposures;
    std::size_t wrong = 0, frames = 0;
    double next = begin + period_us;
    // The camera's frames until the program is over; each exposure must lie in one lamp's light.
    while (test::of_kind(host.events, EventKind::program_done).empty() && frames < 100) {
        while (board.now_us() < next) {
            if (const auto event = host.next_event(std::min(1.0, std::max(0.01, (next - board.now_us()) / 1000))))
                host.events.push_back(*event);
        }
        board.set_strobe(true);
        const double opened = board.now_us();
        const std::uint64_t lit = board.lamps().lit;
        if (lit == 0) break;
        const std::size_t switched = switches.size();
        ++frames;
        board.run_us(exposure_us - 1);  // the strobe falls here; what follows is read-out
        wrong += switches.size() != switched || board.lamps().lit != lit ? 1U : 0U;
        board.run_us(5);
        board.set_strobe(false);
        while (const auto event = host.next_event(0.05)) host.events.push_back(*event);
        if (frames % 8 == 0) host.command(Command::heartbeat);
        next = opened + period_us;
    }
    const auto done = steps_done();
    ASSERT_EQ(done.size(), 64U);
    const double seconds = (done.back().time_us - done.front().time_us) / 1e6;
    std::printf("%s\n", fmt::format("strobed at {:3.0f} frames a second: {:.2f} lights a second, {} of {} frames wrong",
                                    GetParam(), 63 / seconds, wrong, frames)
                            .c_str());
    EXPECT_EQ(wrong, 0U);
    EXPECT_EQ(frames, 64U);
    EXPECT_GE(63 / seconds, 0.95 * GetParam());
}

INSTANTIATE_TEST_SUITE_P(FramesPerSecond, Strobed, testing::Values(30.0, 60.0, 120.0));

}  // namespace
}  // namespace darkbox
