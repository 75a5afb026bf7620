#include <fmt/format.h>
#include <gmock/gmock.h>

#include <bit>
#include <csignal>
#include <cstdlib>
#include <fstream>
#include <iostream>
#include <nlohmann/json.hpp>
#include <optional>
#include <thread>

#include "acquisition/device/clock.h"
#include "acquisition/device/device_error.h"
#include "acquisition/session/session.h"
#include "rig/lamps/usb_lamps.h"
#include "tests/hil/daemon.h"
#include "tests/hil/machine.h"
#include "tests/hil/usb_board.h"
#include "tests/support/test_data.h"

namespace darkbox {
namespace {

namespace fs = std::filesystem;
using namespace std::chrono_literals;
using nlohmann::json;
using testing::Contains;
using testing::ElementsAre;
using testing::Field;
using testing::HasSubstr;

constexpr const char* usb_camera_node = "/dev/v4l/by-id/usb-darkbox_Digital_twin_TWIN0001-video-index0";
constexpr std::size_t usb_lamp_count = 16;

std::uint64_t bit_of(std::size_t lamp) { return std::uint64_t{1} << lamp; }

/// The closed loop's rig with its lamps on the controller, lamp-01 on channel 0 and so on.
std::string usb_rig(const std::string& mode) {
    std::string toml = test::text_of(DARKBOX_HIL_RIG);
    const auto replace = [&](const std::string& old, const std::string& with) {
        const std::size_t at = toml.find(old);
        if (at == std::string::npos) throw std::runtime_error("the rig has no " + old);
        toml.replace(at, old.size(), with);
    };
    replace("driver = \"gpio\"\ndistant = true\n[lamps.gpio]\nchip = \"lamps\"\n",
            fmt::format("driver = \"usb\"\ndistant = true\n[lamps.usb]\nserial = \"{}\"\n", test::UsbBoard::serial));
    replace("[capture]\n", fmt::format("[capture]\nmode = \"{}\"\n", mode));
    for (std::size_t i = 0; i < usb_lamp_count; ++i)
        replace(fmt::format("line = \"{}\"\n", i), fmt::format("channel = {}\nmax_duty = 0.79\n", i));
    return toml;
}

/// The emulated controller behind the kernel's own USB host, driven through usbfs by the libusb that is installed.
class UsbLampsOfTheMachine : public testing::Test {
protected:
    void SetUp() override {
        DARKBOX_NEED_MACHINE();
        std::ofstream(rig) << usb_rig("settled");
    }
    /// Sees what it lights, by the channels of its shift registers.
    UsbLamps lamps() const { return UsbLamps(load_rig(rig)); }

    test::TemporaryFolder folder;
    const fs::path rig = folder.path() / "rig.toml";
    std::optional<test::UsbBoard> board;
};

class UsbLampsDriver : public UsbLampsOfTheMachine {
protected:
    void SetUp() override {
        UsbLampsOfTheMachine::SetUp();
        if (IsSkipped()) return;
        board.emplace(folder.path());
    }
};

TEST_F(UsbLampsOfTheMachine, AreFoundBySerialByThoseWhoMay) {
    test::must("getent group darkbox || groupadd --system darkbox");
    test::must(fmt::format("cp {} /etc/udev/rules.d/ && udevadm control --reload", DARKBOX_UDEV_RULE));
    board.emplace(folder.path());
    test::must("udevadm settle");
    EXPECT_EQ(test::shell("stat -c '%a %G' " + board->node()).text, "660 darkbox\n");
    const auto listed_as = [](const std::string& group) {
        return test::shell(fmt::format("setpriv --reuid=65534 --regid={} --clear-groups {} lamps list --boards", group,
                                       test::program("darkbox")));
    };
    const test::Printed member = listed_as("darkbox");
    EXPECT_EQ(member.status, 0) << member.text;
    EXPECT_THAT(member.text, HasSubstr(std::string(test::UsbBoard::serial) + "  "));
    const test::Printed stranger = listed_as("nogroup");
    EXPECT_THAT(stranger.text, testing::Not(HasSubstr(test::UsbBoard::serial))) << "and says why";
    std::cout << "  told: " << member.text << "  told: " << stranger.text;
}

TEST_F(UsbLampsDriver, AreLitOneAtATimeAndStepped) {
    UsbLamps lamps = this->lamps();
    std::vector<std::uint64_t> wanted;
    for (std::uint32_t i = 0; i < usb_lamp_count; ++i) {
        lamps.light(LampId{i}, 1.0);
        EXPECT_EQ(board->lit(), bit_of(i));
        wanted.push_back(bit_of(i));
    }
    lamps.dark();
    EXPECT_TRUE(board->is_dark());

    std::vector<LampStep> program;
    for (std::uint32_t i = 0; i < usb_lamp_count; ++i) {
        LampStep step;
        step.lamp = LampId{i};
        step.lead = 1ms;
        step.exposure = 10ms;
        program.push_back(step);
        wanted.push_back(bit_of(i));
    }
    lamps.run_program(program);
    SystemClock clock;
    std::size_t done = 0;
    while (const auto step = lamps.next_step_done(clock.now() + 20s)) EXPECT_EQ(step->step, done++);
    EXPECT_EQ(done, usb_lamp_count);
    EXPECT_TRUE(board->is_dark());
    EXPECT_EQ(board->history(), wanted) << "no two at once, none left out";
}

TEST_F(UsbLampsDriver, APulledCableIsDarkAndNamed) {
    UsbLamps lamps = this->lamps();
    lamps.light(LampId{2}, 1.0);
    ASSERT_EQ(board->lit(), bit_of(2));
    board->pull_cable();
    EXPECT_TRUE(test::comes_true([&] { return board->is_dark(); })) << "by its own heartbeat";
    try {
        lamps.light(LampId{3}, 1.0);
        ADD_FAILURE() << "no DeviceError";
    } catch (const DeviceError& error) {
        EXPECT_THAT(error.what(), HasSubstr("lamp controller"));
        std::cout << "  told: " << error.what() << "; " << error.hint() << '\n';
    }
    board->plug_cable();
    test::comes_true([&] {
        try {
            lamps.dark();
            return true;
        } catch (const DeviceError& error) {  // once: a lit lamp was interrupted
            std::cout << "  told: " << error.what() << '\n';
            return false;
        }
    });
    lamps.light(LampId{3}, 1.0);
    EXPECT_EQ(board->lit(), bit_of(3)) << "without a restart";
}

TEST_F(UsbLampsDriver, AHungFirmwareIsResetByItsWatchdogAndTakenUpAgain) {
    UsbLamps lamps = this->lamps();
    lamps.light(LampId{5}, 1.0);
    const std::string before = board->node();
    board->hang();
    EXPECT_TRUE(test::comes_true([&] { return board->is_dark(); }));
    EXPECT_TRUE(test::comes_true([&] { return !board->node().empty() && board->node() != before; }))
        << "the kernel saw it go and come back";
    test::comes_true([&] {
        try {
            lamps.dark();
            return true;
        } catch (const DeviceError& error) {
            std::cout << "  told: " << error.what() << '\n';
            return false;
        }
    });
    lamps.light(LampId{6}, 1.0);
    EXPECT_EQ(board->lit(), bit_of(6));
}

TEST_F(UsbLampsDriver, AKilledDriverLeavesThemToTheBoard) {
    test::ChildProcess driver({test::program("darkbox"), "lamps", "on", "lamp-04", "--rig", rig}, folder.path() / "on");
    ASSERT_TRUE(test::comes_true([&] { return board->lit() == bit_of(3); }, test::start_of_a_program)) << driver.err();
    driver.signal(SIGKILL);
    driver.wait();
    EXPECT_TRUE(test::comes_true([&] { return board->is_dark(); }));
    EXPECT_THAT(board->history(), ElementsAre(bit_of(3)));
}

/// With the twin's camera behind uvcvideo, both on the machine's USB host: the whole rig over USB.
class UsbSession : public UsbLampsOfTheMachine {
protected:
    void plug_in(const std::string& mode) {
        std::ofstream(rig) << usb_rig(mode);
        const fs::path strobe = folder.path() / "strobe";
        board.emplace(folder.path(), strobe);
        twin.emplace(std::vector<std::string>{test::program("twin_camera"), "run", "--rig", rig, "--pictures",
                                              std::string(std::getenv("HIL_TWIN")) + "/pictures", "--seen",
                                              board->record(), "--strobe", strobe},
                     folder.path() / "twin");
        ASSERT_TRUE(test::comes_true([] { return fs::exists(usb_camera_node); })) << twin->err();
        daemon.emplace(folder.path(), rig);
    }
    void expect_complete(const std::string& object, std::size_t frames) {
        const auto end = daemon->ended();
        ASSERT_EQ(end.at("event"), "done") << end.dump();
        const Session captured = daemon->session(object);
        captured.verify();
        EXPECT_EQ(captured.frames().size(), frames);
        for (const FrameRecord& frame : captured.frames())
            EXPECT_TRUE(frame.verified) << frame.file << ": " << frame.verification;
        for (const SessionEvent& event : captured.events()) std::cout << "  told: " << event.what << '\n';
        EXPECT_TRUE(board->is_dark());
        for (const std::uint64_t lit : board->history()) EXPECT_EQ(std::popcount(lit), 1) << "two lamps at once";
    }

    std::optional<test::ChildProcess> twin;
    std::optional<test::Daemon> daemon;
};

TEST_F(UsbSession, SixteenLampsThroughDarkboxd) {
    plug_in("settled");
    daemon->start_capture("usb");
    expect_complete("usb", usb_lamp_count + 2);
    daemon->hand_out("usb");
    daemon.reset();
    std::cout << "  the board: " << board->unplug();
}

/// The camera's strobe line goes to the board, which counts the exposure and steps by itself. A board whose emulation
/// is late steps too late: such lamps are taken again in settled mode, and the session says so.
TEST_F(UsbSession, StepsAtTheCamerasStrobeOrSaysWhyNot) {
    plug_in("strobed");
    daemon->start_capture("strobed");
    expect_complete("strobed", usb_lamp_count + 2);
    std::size_t stepped = 0;
    const Session captured = daemon->session("strobed");
    for (const FrameRecord& frame : captured.frames())
        stepped += frame.verification.find("strobe's step") != std::string::npos ? 1 : 0;
    std::cout << "  " << stepped << " of " << usb_lamp_count << " lamps by the strobe\n";
    if (stepped < usb_lamp_count) {
        EXPECT_THAT(captured.events(), Contains(Field(&SessionEvent::what, HasSubstr("strobed mode: "))));
    }
    daemon.reset();
    std::cout << "  the board: " << board->unplug();
}

TEST_F(UsbSession, AKilledDaemonLeavesThemToTheBoard) {
    plug_in("settled");
    daemon->start_capture("killed", {"lamp-01", "lamp-02"});
    ASSERT_TRUE(test::comes_true([&] { return board->lit() == bit_of(1); })) << daemon->log();
    daemon->signal(SIGKILL);
    daemon->wait();
    EXPECT_TRUE(test::comes_true([&] { return board->is_dark(); }));
}

TEST_F(UsbSession, APulledCableRepeatsTheShot) {
    plug_in("settled");
    daemon->start_capture("knocked", {"lamp-01", "lamp-02"});
    ASSERT_TRUE(test::comes_true([&] { return board->lit() == bit_of(1); })) << daemon->log();
    board->pull_cable();
    EXPECT_TRUE(test::comes_true([&] { return board->is_dark(); }));
    board->plug_cable();
    expect_complete("knocked", 4);
    EXPECT_THAT(daemon->session("knocked").events(),
                Contains(Field(&SessionEvent::what, HasSubstr("lamp controller"))));
}

}  // namespace
}  // namespace darkbox
