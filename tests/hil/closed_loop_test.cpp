#include <gmock/gmock.h>

#include <csignal>
#include <cstdlib>
#include <iostream>
#include <optional>
#include <thread>

#include "acquisition/camera/v4l2_camera.h"
#include "acquisition/session/session.h"
#include "rig/capture/picture.h"
#include "rig/lamps/gpio_lines.h"
#include "tests/hil/daemon.h"
#include "tests/hil/gpio_chip.h"
#include "tests/hil/machine.h"
#include "tests/support/test_data.h"

namespace darkbox {
namespace {

namespace fs = std::filesystem;
using testing::Contains;
using testing::Field;
using testing::HasSubstr;

constexpr const char* camera_node = "/dev/v4l/by-id/usb-darkbox_Digital_twin_TWIN0001-video-index0";

/// The twin, plugged in as a USB camera that sees the lines of a gpio-sim chip; darkboxd drives both through the
/// kernel.
class ClosedLoop : public testing::Test {
protected:
    void SetUp() override {
        DARKBOX_NEED_MACHINE();
        chip.emplace("lamps");
    }

    void plug_in(const std::vector<std::string>& wiring = {}) {
        std::vector<std::string> words{test::program("twin_camera"),
                                       "run",
                                       "--rig",
                                       DARKBOX_HIL_RIG,
                                       "--pictures",
                                       std::string(std::getenv("HIL_TWIN")) + "/pictures",
                                       "--lines",
                                       chip->folder()};
        words.insert(words.end(), wiring.begin(), wiring.end());
        twin.emplace(words, folder.path() / "twin");
        ASSERT_TRUE(test::comes_true([] { return fs::exists(camera_node); }, std::chrono::seconds(30))) << twin->err();
    }
    void start_daemon() { daemon.emplace(folder.path(), DARKBOX_HIL_RIG); }

    /// The last event of this capture.
    test::Daemon::Json capture(const std::string& object, const std::vector<std::string>& lamps = {}) {
        daemon->start_capture(object, lamps);
        return daemon->ended();
    }

    void expect_complete(const std::string& object, std::size_t frames) {
        const auto end = daemon->ended();
        ASSERT_EQ(end.at("event"), "done") << end.dump();
        const Session captured = daemon->session(object);
        captured.verify();
        EXPECT_EQ(captured.frames().size(), frames);
        for (const FrameRecord& frame : captured.frames()) {
            EXPECT_TRUE(frame.verified) << frame.file << ": " << frame.verification;
            EXPECT_NEAR(frame.exposure_s, 0.02, 1e-9) << "not what the camera powers on with";
            EXPECT_EQ(frame.gain, 1.0);
        }
        for (const SessionEvent& event : captured.events()) std::cout << "  told: " << event.what << '\n';
    }

    test::TemporaryFolder folder;
    std::optional<test::GpioChip> chip;
    std::optional<test::ChildProcess> twin;
    std::optional<test::Daemon> daemon;
};

TEST_F(ClosedLoop, SixteenLampsThroughDarkboxd) {
    plug_in();
    start_daemon();
    daemon->start_capture("whole");
    expect_complete("whole", 18);
    EXPECT_TRUE(chip->high_lines().empty());
    daemon->hand_out("whole");
}

TEST_F(ClosedLoop, ExposureAndGainActOnPixels) {
    plug_in();
    SystemClock clock;
    KernelVideoDevice device;
    const auto lines = request_gpio_lines({.chip = "lamps", .lines = {{"0", false}}});
    V4l2Camera camera(device, clock, {.device = camera_node, .format = "Y16", .frame_rate = {}, .crop = {}});
    const auto brightness = [&](bool lit, const CameraConfig& config) {
        lines->set({lit});
        camera.configure(config);
        camera.start();
        double found = 0;
        for (int i = 0; i < 2; ++i) found = mean(to_picture(camera.next_frame(clock.now() + std::chrono::seconds(5))));
        camera.stop();
        return found;
    };
    const CameraConfig plain{.exposure = Seconds(0.01), .gain = 1};
    const double dark = brightness(false, plain);
    const double lit = brightness(true, plain) - dark;
    EXPECT_GT(lit, 300);
    EXPECT_NEAR((brightness(true, {.exposure = Seconds(0.02), .gain = 1}) - dark) / lit, 2.0, 0.06);
    EXPECT_NEAR((brightness(true, {.exposure = Seconds(0.01), .gain = 2}) - dark) / lit, 2.0, 0.06);
}

/// uvcvideo hands a damaged frame on with a flag, or, by default, drops it; it decides when a camera is plugged in.
class ClosedLoopDamage : public ClosedLoop {
protected:
    Session capture_with_damage(const std::string& nodrop) {
        test::must("modprobe uvcvideo");
        test::put(nodrop, "/sys/module/uvcvideo/parameters/nodrop");
        plug_in();
        start_daemon();
        daemon->start_capture("damaged", {"lamp-02"});
        // The first of them may have been exposed before the lamp was lit: nobody looks at such a one.
        EXPECT_TRUE(test::comes_true([&] { return chip->is_high(1); }));
        for (int i = 0; i < 3; ++i) {
            twin->signal(SIGUSR1);
            std::this_thread::sleep_for(std::chrono::milliseconds(300));
        }
        expect_complete("damaged", 3);
        test::put("0", "/sys/module/uvcvideo/parameters/nodrop");
        return daemon->session("damaged");
    }
};

TEST_F(ClosedLoopDamage, FlaggedFrameIsTakenAgain) {
    EXPECT_THAT(capture_with_damage("1").events(),
                Contains(Field(&SessionEvent::what, HasSubstr("flagged as damaged"))));
}

TEST_F(ClosedLoopDamage, FrameThatTheDriverDropsIsCounted) {
    EXPECT_THAT(capture_with_damage("0").events(), Contains(Field(&SessionEvent::what, HasSubstr("the camera lost"))));
}

TEST_F(ClosedLoop, UnpluggedCameraIsWaitedForInTheDark) {
    plug_in({"--unplugged", "4"});
    start_daemon();
    daemon->start_capture("unplugged", {"lamp-01", "lamp-02"});
    ASSERT_TRUE(test::comes_true([&] { return chip->is_high(1); }));
    twin->signal(SIGUSR2);
    ASSERT_TRUE(test::comes_true([] { return !fs::exists(camera_node); }));
    EXPECT_TRUE(test::comes_true([&] { return chip->high_lines().empty(); }));
    EXPECT_FALSE(fs::exists(camera_node)) << "dark before it came back";
    while (!fs::exists(camera_node)) EXPECT_TRUE(chip->high_lines().empty());
    expect_complete("unplugged", 4);
    EXPECT_THAT(daemon->session("unplugged").events(),
                Contains(Field(&SessionEvent::what, HasSubstr("was unplugged"))));
}

/// Negative controls: a loop that is not closed must not pass.
TEST_F(ClosedLoop, CutLampIsNamed) {
    plug_in({"--cut", "4"});
    start_daemon();
    const auto end = capture("cut", {"lamp-04", "lamp-05", "lamp-06"});
    EXPECT_EQ(end.at("event"), "failed");
    EXPECT_THAT(end.at("detail").get<std::string>(), HasSubstr("lamp 'lamp-05'"));
    EXPECT_THAT(end.at("detail").get<std::string>(), HasSubstr("as dark as the dark frame"));
    std::cout << "  told: " << end.at("detail") << '\n';
    EXPECT_TRUE(chip->high_lines().empty());
}

TEST_F(ClosedLoop, SwappedLampsAreNamedByWhereTheyShineFrom) {
    plug_in({"--swap", "2", "5"});
    start_daemon();
    const auto end = capture("swapped", {"lamp-01", "lamp-02", "lamp-03", "lamp-04", "lamp-05", "lamp-06"});
    ASSERT_EQ(end.at("event"), "done") << end.dump();
    const Session captured = daemon->session("swapped");
    captured.verify();
    ASSERT_EQ(captured.frames().size(), 8U);
    for (const FrameRecord& frame : captured.frames()) {
        const bool swapped = frame.lamp_name == "lamp-03" || frame.lamp_name == "lamp-06";
        EXPECT_EQ(frame.verified, !swapped) << frame.file << ": " << frame.verification;
        if (swapped) {
            EXPECT_THAT(frame.verification, HasSubstr("lamp-03 and lamp-06 are exchanged"));
        }
    }
    for (const SessionEvent& event : captured.events()) std::cout << "  told: " << event.what << '\n';
    daemon->hand_out("swapped");
}

}  // namespace
}  // namespace darkbox
