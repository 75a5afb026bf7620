#pragma once

#include <linux/videodev2.h>

#include <algorithm>
#include <cerrno>
#include <deque>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "acquisition/camera/video_device.h"
#include "acquisition/device/clock.h"

namespace darkbox::test {

class FakeTime final : public Clock {
public:
    TimePoint now() const override { return now_; }
    void sleep_until(TimePoint moment) override {
        now_ = std::max(now_, moment);
        if (passed) passed(now_);
    }

    std::function<void(TimePoint)> passed;  ///< called whenever time went on

private:
    TimePoint now_{std::chrono::seconds(100)};
};

struct FakeControl {
    std::int32_t minimum = 0;
    std::int32_t maximum = 1;
    std::int32_t step = 1;
    std::int32_t default_value = 0;
    std::int32_t value = 0;
    std::uint32_t flags = 0;
    bool holds = true;  ///< false: what is set is accepted and forgotten
};

struct FakeMode {
    std::uint32_t fourcc = 0;
    std::uint32_t width = 0;
    std::uint32_t height = 0;
    std::vector<v4l2_fract> intervals;
};

/// One frame as the fake's sensor makes it; a script may change any of it before it is queued.
struct FakeFrame {
    std::uint32_t sequence = 0;
    TimePoint stamp;
    std::uint32_t flags = V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC | V4L2_BUF_FLAG_TSTAMP_SRC_SOE;
    std::vector<std::byte> bytes;
    bool lost = false;  ///< counted, and never delivered
    int error = 0;      ///< VIDIOC_DQBUF fails with it instead
};

/// Answers like a V4L2 driver whose camera makes a frame each period of virtual time, into whatever buffer is queued.
/// What it does at a call out of order is what the kernel's documentation says: so a driver that leaves out a step, or
/// leaks one, fails against it.
class FakeVideoDevice final : public VideoDevice {
public:
    explicit FakeVideoDevice(FakeTime& time) : time_(time) {}

    int open(const std::string& path) override;
    void close() override;
    int ioctl(unsigned long request, void* argument) override;
    Mapping map(std::size_t length, std::int64_t offset) override;
    void unmap(std::span<std::byte> bytes) override;
    Readiness poll(Nanoseconds patience) override;

    void unplug() { plugged_ = false; }
    bool plugged() const { return plugged_; }
    /// As another opening of the node: formats and controls are as the camera's power-up leaves them.
    void plug_in();

    std::string path = "/dev/v4l/by-id/usb-Fake_0001-video-index0";
    std::string driver = "fake";
    std::string card = "Fake camera";
    std::uint32_t capabilities = V4L2_CAP_VIDEO_CAPTURE | V4L2_CAP_STREAMING;
    std::vector<FakeMode> modes;
    std::map<std::uint32_t, FakeControl> controls;       ///< at power-up
    std::map<std::uint32_t, FakeControl> live_controls;  ///< now
    std::uint32_t padding = 0;                           ///< bytes behind each row
    bool crops = false;
    int refuses_crop_with = ENOTTY;
    bool mute = false;                                ///< no frame comes
    std::map<unsigned long, std::deque<int>> errors;  ///< of the next calls of a request
    std::function<void(FakeFrame&)> script;
    std::vector<std::string> broken_rules;  ///< calls that no kernel would have let pass
    int opened = 0;
    int streams = 0;

private:
    struct Buffer {
        std::vector<std::byte> bytes;
        bool mapped = false;
        bool queued = false;
    };
    const FakeMode* current() const;
    bool gone() const { return !plugged_ || stale_; }
    int answer(unsigned long request, void* argument);
    int enumerate_format(v4l2_fmtdesc& entry) const;
    int enumerate_size(v4l2_frmsizeenum& entry) const;
    int enumerate_interval(v4l2_frmivalenum& entry) const;
    int set_format(v4l2_format& format);
    int set_rate(v4l2_streamparm& parameters);
    int select(v4l2_selection& selection);
    int query_control(v4l2_queryctrl& control) const;
    int set_control(const v4l2_control& control);
    int request_buffers(v4l2_requestbuffers& request);
    int queue(const v4l2_buffer& buffer);
    int dequeue(v4l2_buffer& buffer);
    FakeFrame make_frame();

    FakeTime& time_;
    bool open_ = false;
    bool plugged_ = true;
    bool stale_ = false;  ///< this opening is of a camera that was unplugged since
    bool streaming_ = false;
    std::uint32_t fourcc_ = 0, width_ = 0, height_ = 0;
    v4l2_fract interval_{1, 25};
    std::vector<Buffer> buffers_;
    std::deque<std::uint32_t> queue_;
    std::deque<FakeFrame> finished_;
    TimePoint next_frame_;
    std::uint32_t sequence_ = 0;
};

}  // namespace darkbox::test
