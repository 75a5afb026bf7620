#include <gmock/gmock.h>
#include <linux/videodev2.h>

#include <filesystem>
#include <functional>
#include <iostream>
#include <optional>
#include <utility>

#include "acquisition/camera/v4l2_camera.h"
#include "rig/capture/capture_session.h"
#include "tests/hil/machine.h"
#include "tests/hil/rig_text.h"
#include "tests/hil/vivid.h"
#include "tests/support/test_data.h"

namespace darkbox {
namespace {

using test::Vivid;
using testing::Contains;
using testing::Field;
using testing::HasSubstr;

/// Lamps that shine through vivid's controls: noise alone, and noise with a white square in it. Darkness is black.
class PatternLamps final : public LampArray {
public:
    explicit PatternLamps(const Vivid& vivid) : vivid_(vivid) { dark(); }

    std::size_t size() const override { return 3; }
    void light(LampId lamp, double) override {
        show(Vivid::noise, lamp.value == 0 ? 0 : 1);
        lit = lamp;
        if (lamp.value != 1) return;
        ++times_lamp_2_was_lit;
        std::exchange(when_lamp_2_is_lit, [] {})();
    }
    void dark() override {
        show(Vivid::black, 0);
        lit.reset();
    }
    LampHealth health() override { return {}; }

    std::function<void()> when_lamp_2_is_lit = [] {};  ///< done once
    std::optional<LampId> lit;
    int times_lamp_2_was_lit = 0;

private:
    void show(int pattern, int square) const {
        vivid_.set(Vivid::test_pattern, pattern);
        vivid_.set(Vivid::show_square, square);
    }

    const Vivid& vivid_;
};

/// A camera that lets somebody act before each wait for a frame.
class WatchedCamera final : public Camera {
public:
    WatchedCamera(Camera& camera, std::function<void()> before) : camera_(camera), before_(std::move(before)) {}

    CameraInfo configure(const CameraConfig& config) override { return camera_.configure(config); }
    void start() override { camera_.start(); }
    Frame next_frame(TimePoint deadline) override {
        before_();
        return camera_.next_frame(deadline);
    }
    void stop() override { camera_.stop(); }

private:
    Camera& camera_;
    std::function<void()> before_;
};

/// Whole captures by the V4L2 driver, with vivid's faults injected while lamp 2 is lit.
class VividFaults : public testing::Test {
protected:
    void SetUp() override {
        DARKBOX_NEED_MACHINE();
        vivid.emplace();
        lamps.emplace(*vivid);
        rig = parse_rig(test::rig_toml({.device = vivid->webcam(),
                                        .camera = "format = \"GREY\"\nwidth = 320\nheight = 180\nframe_rate = 25\n",
                                        .extra = "[capture]\nmax_dark = 0.1\ntries = 4\nframe_deadline_s = 5\n",
                                        .lamps = 3}),
                        "rig.toml");
    }

    V4l2Options options() const {
        return {
            .device = rig.camera.device, .format = "GREY", .width = 320, .height = 180, .frame_rate = 25.0, .crop = {}};
    }

    CapturedSession capture() {
        V4l2Camera kernels(device, clock, options());
        WatchedCamera camera(kernels, before_each_wait);
        return capture_session({.folder = folder.path() / "session", .object = "bars", .lamps = {"lamp-01", "lamp-02"}},
                               rig, *lamps, camera, clock);
    }

    /// Injected while lamp 2 is lit; the session is complete all the same, and tells of it.
    void expect_repaired(const std::function<void()>& inject, const std::string& told) {
        lamps->when_lamp_2_is_lit = inject;
        const CapturedSession captured = capture();
        EXPECT_EQ(captured.session.frames().size(), 4U);
        for (const FrameRecord& record : captured.session.frames()) EXPECT_TRUE(record.verified) << record.file;
        EXPECT_THAT(captured.session.events(), Contains(Field(&SessionEvent::what, HasSubstr(told))));
        for (const SessionEvent& event : captured.session.events()) std::cout << "  told: " << event.what << '\n';
        EXPECT_FALSE(lamps->lit);
    }
    void expect_repaired(std::uint32_t control, const std::string& told) {
        expect_repaired([this, control] { vivid->set(control, 1); }, told);
    }

    /// Injected before the capture: it does not begin, says why, and the next one is good.
    void expect_named(std::uint32_t control, const std::string& told) {
        vivid->set(control, 1);
        try {
            capture();
            ADD_FAILURE() << "no DeviceError";
        } catch (const DeviceError& error) {
            EXPECT_THAT(error.what(), HasSubstr(told));
            std::cout << "  told: " << error.what() << "; " << error.hint() << '\n';
        }
        EXPECT_FALSE(lamps->lit);
        std::filesystem::remove_all(folder.path() / "session");
        EXPECT_EQ(capture().session.frames().size(), 4U);
    }

    std::function<void()> before_each_wait = [] {};
    std::optional<Vivid> vivid;
    std::optional<PatternLamps> lamps;
    RigDescription rig;
    test::TemporaryFolder folder;
    SystemClock clock;
    KernelVideoDevice device;
};

TEST_F(VividFaults, NoneLeavesACompleteSession) {
    const CapturedSession captured = capture();
    EXPECT_EQ(captured.session.frames().size(), 4U);
    EXPECT_EQ(captured.summary.repeated, 0);
    for (const SessionEvent& event : captured.session.events()) std::cout << "  told: " << event.what << '\n';
}

/// Every buffer that is filled in the lamp's first light: nobody looks at one that was exposed too early.
TEST_F(VividFaults, FlaggedBufferIsTakenAgain) {
    before_each_wait = [this] {
        if (lamps->lit && lamps->lit->value == 1 && lamps->times_lamp_2_was_lit == 1)
            vivid->set(Vivid::inject_buffer_error, 1);
    };
    expect_repaired(Vivid::inject_buffer_error, "flagged as damaged");
}

TEST_F(VividFaults, DroppedBuffersAreCounted) {
    expect_repaired([this] { vivid->set(Vivid::percentage_of_dropped_buffers, 90); }, "the camera lost");
}

TEST_F(VividFaults, FatalStreamingErrorIsFollowedByARestart) {
    expect_repaired(Vivid::inject_fatal_error, "Input/output error");
}

TEST_F(VividFaults, RefusedRequeuingIsFollowedByARestart) { expect_repaired(Vivid::inject_qbuf_error, "VIDIOC_QBUF"); }

TEST_F(VividFaults, RestartThatFailsIsTriedAgain) {
    for (const auto& [control, told] : {std::pair{Vivid::inject_reqbufs_error, "VIDIOC_REQBUFS"},
                                        std::pair{Vivid::inject_streamon_error, "VIDIOC_STREAMON"}}) {
        std::filesystem::remove_all(folder.path() / "session");
        expect_repaired(
            [&, control = control] {
                vivid->set(Vivid::inject_fatal_error, 1);
                vivid->set(control, 1);
            },
            told);
    }
}

TEST_F(VividFaults, RefusedBuffersAreNamed) { expect_named(Vivid::inject_reqbufs_error, "VIDIOC_REQBUFS"); }
TEST_F(VividFaults, RefusedQueuingIsNamed) { expect_named(Vivid::inject_qbuf_error, "VIDIOC_QBUF"); }
TEST_F(VividFaults, RefusedStreamIsNamed) { expect_named(Vivid::inject_streamon_error, "VIDIOC_STREAMON"); }

TEST_F(VividFaults, DisconnectedCameraIsWaitedFor) {
    expect_repaired(Vivid::disconnect, "was unplugged or is not there");
}

}  // namespace
}  // namespace darkbox
