#include <gmock/gmock.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <fstream>
#include <optional>

#include "acquisition/device/device_error.h"
#include "rig/lamps/gpio_lamps.h"
#include "tests/hil/gpio_chip.h"
#include "tests/hil/kernel_trace.h"
#include "tests/hil/machine.h"
#include "tests/hil/rig_text.h"
#include "tests/support/child_process.h"
#include "tests/support/test_data.h"

namespace darkbox {
namespace {

using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

template <class Act>
std::string device_error_of(Act&& act) {
    try {
        act();
    } catch (const DeviceError& error) {
        EXPECT_FALSE(error.hint().empty()) << error.what();
        return error.what();
    }
    ADD_FAILURE() << "no DeviceError";
    return {};
}

class Gpio : public testing::Test {
protected:
    void SetUp() override {
        DARKBOX_NEED_MACHINE();
        other_.emplace("another");
        chip_.emplace("lamps", test::GpioChip::Lines{
                                   .count = 16, .names = {{2, "LAMP-A"}, {5, "LAMP-B"}}, .hogs = {{15, "the-fan"}}});
    }

    test::GpioChip& chip() { return *chip_; }

private:
    std::optional<test::GpioChip> other_;
    std::optional<test::GpioChip> chip_;
};

RigDescription rig_of(int lamps = 15) { return parse_rig(test::rig_toml({.lamps = lamps}), "rig.toml"); }

TEST_F(Gpio, ChipIsFoundByItsLabelAndLinesByNameOrNumber) {
    const auto lines = request_gpio_lines({.chip = "lamps", .lines = {{"LAMP-B", false}, {"9", false}}});
    lines->set({true, false});
    EXPECT_THAT(chip().high_lines(), ElementsAre(5));
    lines->set({false, true});
    EXPECT_THAT(chip().high_lines(), ElementsAre(9));
}

TEST_F(Gpio, ActiveLowLinesAreHighInTheDark) {
    const auto lines = request_gpio_lines({.chip = "lamps", .lines = {{"0", true}, {"1", false}, {"2", true}}});
    EXPECT_THAT(chip().high_lines(), ElementsAre(0, 2)) << "dark from the request on";
    lines->set({true, false, false});
    EXPECT_THAT(chip().high_lines(), ElementsAre(2));
    lines->set({false, true, false});
    EXPECT_THAT(chip().high_lines(), ElementsAre(0, 1, 2));
}

TEST_F(Gpio, WhatIsMissingOrTakenIsNamed) {
    const auto error = [](const std::string& label, const std::string& line) {
        return device_error_of([&] { request_gpio_lines({.chip = label, .lines = {{line, false}}}); });
    };
    EXPECT_THAT(error("lamp", "1"), HasSubstr("no GPIO chip with the label \"lamp\""));
    EXPECT_THAT(error("lamps", "LAMP-C"), HasSubstr("no line named \"LAMP-C\""));
    EXPECT_THAT(error("lamps", "16"), HasSubstr("it has lines 0 to 15"));
    EXPECT_THAT(error("lamps", "15"), HasSubstr("line 15 of GPIO chip \"lamps\" is held by \"the-fan\""));

    const test::ChildProcess holder({"/usr/bin/gpioset", "--mode=signal", "lamps", "5=1"}, "/dev/shm/gpioset");
    ASSERT_TRUE(test::comes_true([&] { return chip().is_high(5); }));
    EXPECT_THAT(error("lamps", "LAMP-B"), HasSubstr("line LAMP-B of GPIO chip \"lamps\" is held by \"gpioset\""));
}

TEST_F(Gpio, OneLampIsLitAtATime) {
    const RigDescription rig = rig_of();
    LampGuardian guardian(gpio_request(rig), request_gpio_lines);
    GpioLamps lamps(rig, guardian);
    const test::KernelTrace trace({"gpio/gpio_value"});
    for (std::uint32_t i = 0; i < rig.lamps.size(); ++i) {
        lamps.light(LampId{i}, 1.0);
        EXPECT_THAT(chip().high_lines(), ElementsAre(i));
    }
    lamps.dark();
    EXPECT_THAT(chip().high_lines(), IsEmpty());

    std::vector<bool> high(16);
    std::size_t rises = 0;
    for (const auto& [offset, rises_now] : test::line_changes(trace.events(), chip().first_number())) {
        rises += rises_now && !high.at(offset) ? 1 : 0;
        high.at(offset) = rises_now;
        EXPECT_LE(std::count(high.begin(), high.end(), true), 1) << "line " << offset;
    }
    EXPECT_EQ(rises, rig.lamps.size());
}

TEST_F(Gpio, DecoderChangesItsAddressOnlyWhileItIsDisabled) {
    RigDescription rig = rig_of(8);
    rig.gpio.multiplexer = {.address_lines = {"1", "2", "3"}, .enable_line = "0", .enable_active_low = false};
    for (int i = 0; i < 8; ++i) rig.lamps[static_cast<std::size_t>(i)].address = i;
    LampGuardian guardian(gpio_request(rig), request_gpio_lines);
    GpioLamps lamps(rig, guardian);
    const test::KernelTrace trace({"gpio/gpio_value"});
    for (std::uint32_t i = 0; i < 8; ++i) {
        lamps.light(LampId{i}, 1.0);
        unsigned int seen = 0;
        for (const unsigned int line : chip().high_lines()) seen |= 1U << line;
        EXPECT_EQ(seen, 1U | i << 1) << "enabled at address " << i;
    }
    lamps.dark();
    EXPECT_THAT(chip().high_lines(), IsEmpty());

    std::vector<bool> high(16);
    for (const auto& [offset, rises] : test::line_changes(trace.events(), chip().first_number())) {
        const bool address_moves = offset != 0 && high.at(offset) != rises;
        EXPECT_FALSE(address_moves && high[0]) << "address line " << offset;
        high.at(offset) = rises;
    }
}

TEST_F(Gpio, ChipThatWasUnpluggedIsTakenUpAgain) {
    const RigDescription rig = rig_of();
    LampGuardian guardian(gpio_request(rig), request_gpio_lines);
    GpioLamps lamps(rig, guardian);
    lamps.light(LampId{3}, 1.0);
    chip().unplug();
    EXPECT_THAT(device_error_of([&] { lamps.light(LampId{4}, 1.0); }), HasSubstr("set lines of GPIO chip \"lamps\""));
    EXPECT_THAT(device_error_of([&] { lamps.dark(); }), HasSubstr("no GPIO chip with the label \"lamps\""));
    EXPECT_FALSE(lamps.health().reachable);

    chip().plug();
    lamps.dark();
    EXPECT_THAT(chip().high_lines(), IsEmpty());
    lamps.light(LampId{4}, 1.0);
    EXPECT_THAT(chip().high_lines(), ElementsAre(4));
    EXPECT_TRUE(lamps.health().reachable);
}

/// A daemon whose end of the pipe is closed though it lives on.
TEST_F(Gpio, GuardianDarkensWhenItsPipeCloses) {
    const RigDescription rig = rig_of();
    const pid_t daemon = ::fork();
    if (daemon == 0) {
        LampGuardian guardian(gpio_request(rig), request_gpio_lines);
        GpioLamps lamps(rig, guardian);
        lamps.light(LampId{6}, 1.0);
        ::sleep(1);
        ::close_range(3, ~0U, 0);
        while (true) ::pause();
    }
    EXPECT_TRUE(test::comes_true([&] { return chip().is_high(6); }));
    EXPECT_TRUE(test::comes_true([&] { return chip().high_lines().empty(); }));
    EXPECT_EQ(::kill(daemon, 0), 0) << "the daemon lives";
    ::kill(daemon, SIGKILL);
    ::waitpid(daemon, nullptr, 0);
}

TEST_F(Gpio, DarkboxLampsDrivesThem) {
    const test::TemporaryFolder folder;
    const std::string rig = (folder.path() / "rig.toml").string();
    std::ofstream(rig) << test::rig_toml({.lamps = 15});
    const std::string darkbox = test::program("darkbox");

    test::ChildProcess on({darkbox, "lamps", "on", "lamp-08", "--seconds", "15", "--rig", rig}, folder.path() / "on");
    ASSERT_TRUE(test::comes_true([&] { return chip().is_high(7); }, test::start_of_a_program)) << on.err();
    EXPECT_THAT(chip().high_lines(), ElementsAre(7));
    const test::Printed second = test::shell(darkbox + " lamps dark --rig " + rig);
    EXPECT_EQ(second.status, 1);
    EXPECT_THAT(second.text, HasSubstr("is held by \"darkbox\""));
    on.signal(SIGINT);
    EXPECT_NE(on.wait(), 128 + SIGINT) << "it ends by itself, in the dark";
    EXPECT_THAT(chip().high_lines(), IsEmpty());

    const test::Printed dark = test::shell(darkbox + " lamps dark --rig " + rig);
    EXPECT_EQ(dark.status, 0) << dark.text;
}

TEST_F(Gpio, DoctorNamesWhoHoldsALine) {
    const test::TemporaryFolder folder;
    const std::string rig = (folder.path() / "rig.toml").string();
    std::ofstream(rig) << test::rig_toml({.lamps = 16});  // the last on the line that the kernel gave to a fan
    const std::string doctor = test::program("darkbox") + " doctor --rig " + rig;
    EXPECT_THAT(test::shell(doctor).text, AllOf(HasSubstr("good  line 5 of lamps: free"),
                                                HasSubstr("BAD   line 15 of lamps: held by \"the-fan\"\n"
                                                          "      → stop that program (sudo fuser -v /dev/gpiochip")));

    const test::ChildProcess holder({"/usr/bin/gpioset", "--mode=signal", "lamps", "5=1"}, folder.path() / "gpioset");
    ASSERT_TRUE(test::comes_true([&] { return chip().is_high(5); }));
    const test::Printed held = test::shell(doctor);
    EXPECT_THAT(held.text, HasSubstr("BAD   line 5 of lamps: held by \"gpioset\""));
    EXPECT_TRUE(chip().is_high(5)) << "it only looks";
}

}  // namespace
}  // namespace darkbox
