#include <gmock/gmock.h>

#include <cerrno>
#include <functional>
#include <optional>

#include "acquisition/camera/v4l2_camera.h"
#include "rig/capture/capture_session.h"
#include "tests/acquisition/camera/fake_video_device.h"
#include "tests/acquisition/session/test_frames.h"
#include "tests/rig/capture/two_lamps.h"
#include "tests/support/test_data.h"

namespace darkbox {
namespace {

using std::chrono::milliseconds;
using test::FakeFrame;

constexpr int width = 32, height = 24;

/// A whole capture through the V4L2 driver, with the kernel's answers scripted: what the sensor sees is the lamp that
/// is lit when a frame ends, with noise.
class V4l2Capture : public testing::Test {
protected:
    V4l2Capture() {
        kernel.modes = {{V4L2_PIX_FMT_SGRBG12, width, height, {{1, 50}}}};
        kernel.controls = {{V4L2_CID_EXPOSURE_AUTO, {0, 3, 1, 3, 3}},
                           {V4L2_CID_EXPOSURE_ABSOLUTE, {1, 200, 1, 50, 50}}};
        kernel.script = [this](FakeFrame& frame) {
            frame.flags = V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC | V4L2_BUF_FLAG_TSTAMP_SRC_SOE;
            expose(frame.bytes);
            if (fault) fault(frame);
        };
        rig = parse_rig(R"([rig]
name = "real"
[camera]
driver = "v4l2"
device = "usb-Fake_0001-video-index0"
exposure_ms = 10
[capture]
tries = 4
[lamps]
driver = "gpio"
[lamps.gpio]
chip = "c"
[[lamps.lamp]]
name = "left"
line = "1"
position_mm = [-300, 0, 900]
[[lamps.lamp]]
name = "right"
line = "2"
position_mm = [300, 0, 900]
)",
                        "rig.toml");
    }

    void expose(std::vector<std::byte>& bytes) {
        for (int i = 0; i < width * height; ++i) {
            const int x = i % width;
            int signal = 0;
            if (lamps.lit) signal = 400 + 40 * (lamps.lit->value == 0 ? width - x : x);
            const auto noise = static_cast<int>(random.next() % 21);
            const int sample = 10 + signal + noise;
            bytes[static_cast<std::size_t>(2 * i)] = static_cast<std::byte>(sample & 255);
            bytes[static_cast<std::size_t>(2 * i) + 1] = static_cast<std::byte>(sample >> 8);
        }
    }

    CapturedSession capture() {
        V4l2Options options;
        options.device = rig.camera.device;
        V4l2Camera camera(kernel, time, options);
        return capture_session({.folder = folder.path() / "s", .object = "ball", .lamps = {}}, rig, lamps, camera,
                               time);
    }

    test::TemporaryFolder folder;
    test::FakeTime time;
    test::FakeVideoDevice kernel{time};
    test::Random random{7};
    std::function<void(FakeFrame&)> fault;
    test::TwoLamps lamps;
    RigDescription rig;
};

std::string events_of(const Session& session) {
    std::string all;
    for (const SessionEvent& event : session.events()) all += event.what + "\n";
    return all;
}

TEST_F(V4l2Capture, ASealedSessionOfTheSensorsOwnSamples) {
    const auto [session, summary, findings] = capture();
    EXPECT_EQ(session.frames().size(), 4u);
    EXPECT_EQ(summary.repeated, 0) << events_of(session);
    EXPECT_EQ(session.frames().front().format, "grbg16");
    EXPECT_EQ(session.frames().front().bit_depth, 12);
    EXPECT_THAT(session.info().notes, testing::Contains(testing::HasSubstr("BA12 of 32 x 24")));
    EXPECT_THAT(session.info().notes, testing::Contains(testing::HasSubstr("has no ")));
    session.verify();
}

TEST_F(V4l2Capture, UnpluggedWhileItStreamsTheShotIsRepeatedAndTheSessionSaysSo) {
    int frames = 0;
    TimePoint unplugged;
    fault = [&](FakeFrame&) {
        if (++frames != 6) return;
        kernel.unplug();
        unplugged = time.now();
    };
    // Somebody plugs it in again while the run waits.
    time.passed = [&](TimePoint now) {
        if (kernel.plugged() || now < unplugged + milliseconds(700)) return;
        EXPECT_FALSE(lamps.lit) << "a lost camera is waited for in the dark";
        kernel.plug_in();
    };
    const auto [session, summary, findings] = capture();
    EXPECT_EQ(session.frames().size(), 4u);
    EXPECT_GE(summary.repeated, 1);
    EXPECT_THAT(events_of(session), testing::HasSubstr("was unplugged"));
    EXPECT_EQ(kernel.live_controls.at(V4L2_CID_EXPOSURE_AUTO).value, V4L2_EXPOSURE_MANUAL);
    session.verify();
}

TEST_F(V4l2Capture, DamagedAndShortFramesAreTakenAgain) {
    int frames = 0;
    fault = [&](FakeFrame& frame) {
        ++frames;
        if (frames == 4) frame.flags |= V4L2_BUF_FLAG_ERROR;
        if (frames == 8) frame.bytes.resize(10);
        if (frames == 12) frame.error = EIO;
    };
    const auto [session, summary, findings] = capture();
    EXPECT_EQ(session.frames().size(), 4u);
    EXPECT_GE(summary.repeated, 1) << events_of(session);
    session.verify();
}

TEST_F(V4l2Capture, StampsFromTheFutureEndTheCapture) {
    fault = [](FakeFrame& frame) { frame.stamp += milliseconds(38); };
    EXPECT_THROW(capture(), Error);
    EXPECT_FALSE(lamps.lit);
}

}  // namespace
}  // namespace darkbox
