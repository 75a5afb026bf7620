// The USB lamps' driver and Debian's libusb on the emulated board, in real time.
#include "rig/lamps/usb_lamps.h"

#include <gmock/gmock.h>

#include "acquisition/device/clock.h"
#include "acquisition/device/device_error.h"
#include "tests/firmware/board_fixture.h"
#include "tests/firmware/emulator/usb_testbed.h"

namespace darkbox {
namespace {

using namespace lamp_protocol;
using namespace std::chrono_literals;
using lampctl::HostBoard;
using test::EmulatedBoard;
using test::EmulatedHost;
using testing::ElementsAre;
using testing::HasSubstr;

RigDescription rig_of(const std::string& serial, double heartbeat = 0.4) {
    RigDescription rig;
    rig.lamps_driver = "usb";
    rig.usb.serial = serial;
    rig.usb.heartbeat = Seconds(heartbeat);
    for (int i = 0; i < 8; ++i) {
        LampDescription lamp;
        lamp.name = "lamp-" + std::to_string(i);
        lamp.channel = 7 * i;
        lamp.max_on = Seconds(2);
        lamp.max_duty = 0.79;
        rig.lamps.push_back(lamp);
    }
    return rig;
}

LampControllerOptions options_of(const RigDescription& rig) {
    LampControllerOptions options;
    options.serial = rig.usb.serial;
    options.heartbeat = to_nanoseconds(rig.usb.heartbeat);
    options.replug_patience = 3s;
    return options;
}

Identity identity_of(const char* serial) {
    Identity identity = HostBoard::some_identity();
    std::memset(identity.serial, 0, sizeof identity.serial);
    std::strcpy(identity.serial, serial);
    return lampctl::sealed(identity);
}

class UsbLampsTest : public testing::Test {
protected:
    void SetUp() override {
        if (!test::UsbTestbed::available()) GTEST_SKIP() << "runs under umockdev-wrapper";
        bed.emplace();
        board = bed->plug_in(DARKBOX_LAMP_ELF, identity_of("LC-0001"));
    }
    std::uint64_t lit(int number) {
        std::uint64_t lamps = 0;
        bed->board(number).with_board([&](EmulatedBoard& b, EmulatedHost&) { lamps = b.lamps().lit; });
        return lamps;
    }
    std::uint64_t lit() { return lit(board); }
    bool comes_true(const std::function<bool()>& holds, Nanoseconds patience = 3s) {
        const TimePoint end = SystemClock().now() + patience;
        while (!holds() && SystemClock().now() < end) std::this_thread::sleep_for(2ms);
        return holds();
    }
    static std::uint64_t bit(unsigned lamp) { return std::uint64_t{1} << lamp; }

    std::optional<test::UsbTestbed> bed;
    int board = 0;
};

TEST_F(UsbLampsTest, LightOneLampAndDarken) {
    UsbLamps lamps(rig_of(""));
    EXPECT_EQ(lit(), 0U);
    lamps.light(LampId{3}, 1.0);
    EXPECT_EQ(lit(), bit(21));
    lamps.light(LampId{7}, 0.5);
    EXPECT_EQ(lit(), bit(49));
    lamps.dark();
    EXPECT_EQ(lit(), 0U);
    EXPECT_TRUE(lamps.health().problems.empty());
    EXPECT_NEAR(lamps.health().temperature_c.value_or(0), 25, 0.5);  // of the board's thermistor, at half scale
    EXPECT_THROW(lamps.light(LampId{8}, 1.0), std::invalid_argument);
    EXPECT_THROW(lamps.light(LampId{1}, 0.0), std::invalid_argument);
}

TEST_F(UsbLampsTest, AreDarkAfterTheirDestructor) {
    {
        UsbLamps lamps(rig_of("LC-0001"));
        lamps.light(LampId{0}, 1.0);
        EXPECT_EQ(lit(), bit(0));
    }
    EXPECT_EQ(lit(), 0U);
}

TEST_F(UsbLampsTest, TheHeartbeatKeepsALampLit) {
    UsbLamps lamps(rig_of("LC-0001", 0.25));
    lamps.light(LampId{2}, 1.0);
    std::this_thread::sleep_for(700ms);
    EXPECT_EQ(lit(), bit(14));
}

TEST_F(UsbLampsTest, ALampLitTooLongIsDarkenedAndTold) {
    RigDescription rig = rig_of("LC-0001");
    rig.lamps[1].max_on = Seconds(0.15);
    UsbLamps lamps(rig);
    lamps.light(LampId{1}, 1.0);
    EXPECT_TRUE(comes_true([&] { return lit() == 0; }));
    EXPECT_THAT(lamps.health().problems, ElementsAre(HasSubstr("max_on_s")));
    try {
        lamps.light(LampId{2}, 1.0);
        FAIL() << "what happened must be told";
    } catch (const DeviceError& error) {
        EXPECT_THAT(error.what(), HasSubstr("max_on_s"));
    }
    lamps.dark();
    lamps.light(LampId{2}, 1.0);
    EXPECT_EQ(lit(), bit(14));
}

TEST_F(UsbLampsTest, TwoBoardsAtOnceAreKnownBySerial) {
    const int other = bed->plug_in(DARKBOX_LAMP_ELF, identity_of("LC-0002"));
    try {
        UsbLamps unclear(rig_of(""));
        FAIL() << "which of two?";
    } catch (const DeviceError& error) {
        EXPECT_THAT(error.what(), HasSubstr("2 lamp controllers"));
    }
    UsbLamps first(rig_of("LC-0001"));
    UsbLamps second(rig_of("LC-0002"));
    first.light(LampId{1}, 1.0);
    second.light(LampId{4}, 1.0);
    EXPECT_EQ(lit(board), bit(7));
    EXPECT_EQ(lit(other), bit(28));
    first.dark();
    EXPECT_EQ(lit(board), 0U);
    EXPECT_EQ(lit(other), bit(28));
}

TEST_F(UsbLampsTest, TellWhichBoardsThereAre) {
    try {
        UsbLamps lamps(rig_of("LC-9"));
        FAIL() << "there is no such board";
    } catch (const DeviceError& error) {
        EXPECT_THAT(error.what(), HasSubstr("'LC-9'"));
        EXPECT_THAT(error.what(), HasSubstr("'LC-0001' at bus 1, port 1"));
    }
}

TEST_F(UsbLampsTest, ComeBackWhenTheCableDoes) {
    UsbLamps lamps(rig_of("LC-0001"), options_of(rig_of("LC-0001")));
    lamps.light(LampId{1}, 1.0);
    bed->pull_cable(board);
    EXPECT_TRUE(comes_true([&] { return lit() == 0; })) << "the board hears nothing any more";
    EXPECT_THROW(lamps.light(LampId{2}, 1.0), DeviceError);
    EXPECT_FALSE(lamps.health().reachable);
    EXPECT_THROW(lamps.dark(), DeviceError) << "nobody knows";
    std::thread hand([&] {
        std::this_thread::sleep_for(300ms);
        bed->plug_cable(board);
    });
    lamps.dark();
    hand.join();
    lamps.light(LampId{2}, 1.0);
    EXPECT_EQ(lit(), bit(14));
}

TEST_F(UsbLampsTest, ComeBackAfterTheFirmwareHung) {
    UsbLamps lamps(rig_of("LC-0001"));
    lamps.light(LampId{1}, 1.0);
    bed->board(board).with_board([](EmulatedBoard& b, EmulatedHost&) { b.hang(EmulatedBoard::Interrupts::off); });
    EXPECT_TRUE(comes_true([&] { return lit() == 0; }));
    EXPECT_THROW(lamps.light(LampId{2}, 1.0), DeviceError);
    lamps.dark();
    lamps.light(LampId{2}, 1.0);
    EXPECT_EQ(lit(), bit(14));
    EXPECT_EQ(lamps.controller().info().reset_cause, reset_watchdog);
}

TEST_F(UsbLampsTest, AStallIsClearedAndTheCommandSaidAgain) {
    UsbLamps lamps(rig_of("LC-0001"));
    for (const std::uint16_t endpoint : {std::uint16_t{command_endpoint}, std::uint16_t{event_endpoint}}) {
        bed->board(board).with_board(
            [&](EmulatedBoard&, EmulatedHost& host) { host.control({0x02, 3, 0, endpoint, 0}); });
        lamps.light(LampId{3}, 1.0);
        EXPECT_EQ(lit(), bit(21));
        lamps.dark();
    }
}

TEST_F(UsbLampsTest, RunAProgramAndTellEachStepInTheHostsTime) {
    UsbLamps lamps(rig_of("LC-0001"));
    std::this_thread::sleep_for(500ms);  // heartbeats tell the board's clock
    std::vector<LampStep> steps;
    for (std::uint32_t i = 0; i < 8; ++i) steps.push_back({LampId{i}, 1.0, 5ms, 15ms, true, false});
    steps.push_back({std::nullopt, 1.0, 5ms, 15ms, false, false});
    const TimePoint begin = SystemClock().now();
    lamps.run_program(steps, 2);
    std::vector<LampStepDone> done;
    while (const auto step = lamps.next_step_done(SystemClock().now() + 2s)) done.push_back(*step);
    const TimePoint end = SystemClock().now();
    Nanoseconds late{};  // of the emulated chip, which a busy machine holds up between telling its time and a step
    test::PacedBoard& paced = bed->board(board);
    paced.with_board([&](EmulatedBoard&, EmulatedHost&) { late = paced.worst_lateness(); });
    ASSERT_EQ(done.size(), 18U);
    for (std::size_t i = 0; i < done.size(); ++i) {
        EXPECT_EQ(done[i].step, i % 9);
        EXPECT_EQ(done[i].round, i / 9);
        EXPECT_EQ(done[i].lamp, i % 9 < 8 ? std::optional(LampId{static_cast<std::uint32_t>(i % 9)}) : std::nullopt);
        EXPECT_GE(done[i].exposure.begin, begin - done[i].uncertainty - late);
        EXPECT_LE(done[i].exposure.end, end + done[i].uncertainty + late);
        EXPECT_EQ(done[i].exposure.end - done[i].exposure.begin, 15ms);
        EXPECT_LT(done[i].uncertainty, 20ms + late);
        if (i > 0) {
            EXPECT_NEAR(to_seconds(done[i].exposure.begin - done[i - 1].exposure.begin), 0.02,
                        0.015 + to_seconds(late));
        }
    }
    EXPECT_EQ(lit(), 0U);
}

TEST_F(UsbLampsTest, AProgramSteppedByTheStrobe) {
    UsbLamps lamps(rig_of("LC-0001"));
    std::vector<LampStep> steps;
    for (std::uint32_t i = 0; i < 4; ++i) steps.push_back({LampId{i}, 1.0, 3ms, 10ms, false, true});
    lamps.run_program(steps);
    for (std::uint32_t i = 0; i < 4; ++i) {
        ASSERT_TRUE(comes_true([&] { return lit() == bit(7 * i); })) << i;
        std::this_thread::sleep_for(30ms);
        EXPECT_EQ(lit(), bit(7 * i)) << "it waits";
        bed->board(board).with_board([](EmulatedBoard& b, EmulatedHost&) {
            b.set_strobe(true);
            b.run_ms(1);
            b.set_strobe(false);
        });
        const auto done = lamps.next_step_done(SystemClock().now() + 1s);
        ASSERT_TRUE(done);
        EXPECT_EQ(done->lamp, LampId{i});
    }
    EXPECT_FALSE(lamps.next_step_done(SystemClock().now() + 1s));
}

TEST_F(UsbLampsTest, StepsBetweenTheExposuresOfAStrobedCamera) {
    constexpr Nanoseconds period = 50ms, up = 20ms, stepped = 30ms;
    const TimePoint first = SystemClock().now() + 200ms;
    const auto phase = [=](TimePoint t) { return (t - first) % period; };  // outlives this test in the strobe line
    struct Switch {
        TimePoint when;
        std::uint64_t lit;
    };
    std::vector<Switch> switches;
    test::PacedBoard& paced = bed->board(board);
    paced.with_board([&](EmulatedBoard& b, EmulatedHost&) {
        paced.strobe_line = [=](TimePoint t) { return t >= first && phase(t) < up; };
        b.on_lamps = [&](const test::LampsSeen& seen) { switches.push_back({paced.board_time(), seen.lit}); };
    });
    UsbLamps lamps(rig_of("LC-0001"));
    ASSERT_NE(lamps.strobed(), nullptr);
    const std::vector<StrobeStep> program{{LampId{0}}, {LampId{3}, 0.5}, {LampId{1}}, {}};
    lamps.strobed()->arm(program, stepped);
    std::vector<StrobeEvent> events;
    EXPECT_TRUE(comes_true([&] {
        for (const StrobeEvent& event : lamps.strobed()->take_events()) events.push_back(event);
        return events.size() == program.size();
    }));
    EXPECT_EQ(lit(), 0U);
    paced.with_board([&](EmulatedBoard& b, EmulatedHost&) { b.on_lamps = nullptr; });
    ASSERT_EQ(events.size(), program.size());
    std::vector<Switch> lights;  // the first moment of each light, and the last darkness
    for (const Switch& s : switches)
        if (s.lit != 0 && (lights.empty() || lights.back().lit != s.lit)) lights.push_back(s);
    lights.push_back(switches.back());
    ASSERT_EQ(lights.size(), program.size());
    for (std::size_t i = 0; i < events.size(); ++i) {
        EXPECT_EQ(events[i].step, i);
        EXPECT_EQ(lights[i].lit, program[i].lamp ? bit(7 * program[i].lamp->value) : 0U);
        EXPECT_GE(lights[i].when, events[i].moment.begin - 1ms) << i;
        EXPECT_LE(lights[i].when, events[i].moment.end + 1ms) << i;
        EXPECT_GE(phase(lights[i].when), up) << "the lamps changed while a frame was exposed";
    }
    EXPECT_THROW(lamps.arm({{LampId{0}}}, stepped), std::invalid_argument) << "it must end dark";
    lamps.arm({{LampId{2}}, {}}, stepped);
    lamps.light(LampId{4}, 1.0);  // ends the program
    EXPECT_EQ(lit(), bit(28));
}

TEST_F(UsbLampsTest, AStrobeThatStaysOutIsTold) {
    RigDescription rig = rig_of("LC-0001");
    for (LampDescription& lamp : rig.lamps) lamp.max_on = Seconds(0.2);
    UsbLamps lamps(rig);
    lamps.run_program({{LampId{0}, 1.0, 3ms, 10ms, false, true}});
    try {
        lamps.next_step_done(SystemClock().now() + 2s);
        FAIL() << "no strobe came";
    } catch (const DeviceError& error) {
        EXPECT_THAT(error.what(), HasSubstr("strobe"));
    }
    lamps.dark();
    EXPECT_TRUE(lamps.health().problems.empty());
}

TEST_F(UsbLampsTest, AnotherVersionOfTheProtocolIsRefusedInWords) {
    bed->board(board).with_board([&](EmulatedBoard&, EmulatedHost&) {
        bed->board(board).alter_answer = [](const test::ControlRequest& request, std::vector<std::uint8_t>& answer) {
            const bool info = request.type == EmulatedHost::vendor_in && request.request == 1;
            if (info) answer.at(offsetof(Info, protocol_major)) = version_major + 1;
        };
    });
    try {
        UsbLamps lamps(rig_of("LC-0001"));
        FAIL() << "it speaks another version";
    } catch (const DeviceError& error) {
        EXPECT_THAT(error.what(), HasSubstr("speaks version 2.0 of the lamp protocol, this darkbox version 1.0"));
        EXPECT_THAT(error.hint(), HasSubstr("darkbox lamps flash"));
    }
    EXPECT_EQ(lit(), 0U);
}

TEST_F(UsbLampsTest, WhatTheBoardCannotDoIsRefused) {
    Identity small = identity_of("LC-0003");
    small.lamps = 16;
    small.most_on_ms = 1500;
    bed->plug_in(DARKBOX_LAMP_ELF, lampctl::sealed(small));
    try {
        UsbLamps lamps(rig_of("LC-0003"));
        FAIL() << "channel 21 of 16";
    } catch (const InputError& error) {
        EXPECT_THAT(error.what(), HasSubstr("max_on_s of 'lamp-0' is 2, but the lamp controller allows up to 1.5"));
    }
}

}  // namespace
}  // namespace darkbox
