#include "rig/capture/frame_source.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "acquisition/device/device_error.h"

namespace darkbox {
namespace {

/// How long a wait for the camera goes without a look at whether the user wants to stop.
constexpr Nanoseconds slice = std::chrono::milliseconds(50);
/// Exposure and gain are read back from hardware in steps of its own.
constexpr double control_tolerance = 0.001;

constexpr const char* damaged_hint = "check the camera's cable and the load on its bus";

bool near(double a, double b) { return std::abs(a - b) <= control_tolerance * std::max(std::abs(a), std::abs(b)); }

}  // namespace

void stop_when_asked(const WorkContext& work) {
    if (work.cancelled())
        throw Cancelled("the capture was cancelled", "every acknowledged frame is kept: resume the session to go on");
}

void check_frame(const Frame& frame, const CameraInfo& camera) {
    if (frame.status != FrameStatus::good)
        throw DeviceError(fmt::format("frame {} is flagged as {} by the camera's driver", frame.sequence,
                                      frame.status == FrameStatus::error ? "damaged" : "truncated"),
                          damaged_hint);
    const std::size_t wanted = static_cast<std::size_t>(camera.width) * static_cast<std::size_t>(camera.height) *
                               static_cast<std::size_t>(channels(camera.format) * bytes_per_sample(camera.format));
    if (frame.width != camera.width || frame.height != camera.height || frame.format != camera.format ||
        frame.bit_depth != camera.bit_depth)
        throw DeviceError(fmt::format("frame {} is {}x{} {} of {} bits, but the camera is set to {}x{} {} of {} bits",
                                      frame.sequence, frame.width, frame.height, name(frame.format), frame.bit_depth,
                                      camera.width, camera.height, name(camera.format), camera.bit_depth),
                          "another program may have changed the camera's format; stop it first");
    if (frame.pixels.size() != wanted)
        throw DeviceError(
            fmt::format("frame {} is truncated: {} of {} bytes", frame.sequence, frame.pixels.size(), wanted),
            damaged_hint);
    if (!near(frame.controls.exposure.count(), camera.controls.exposure.count()) ||
        !near(frame.controls.gain, camera.controls.gain))
        throw DeviceError(fmt::format("frame {} was exposed for {} s at gain {}, not for {} s at gain {}",
                                      frame.sequence, frame.controls.exposure.count(), frame.controls.gain,
                                      camera.controls.exposure.count(), camera.controls.gain),
                          "another program may have changed the camera's controls; stop it first");
}

FrameSource::FrameSource(Camera& camera, Clock& clock, const CameraConfig& config, const WorkContext& work)
    : camera_(camera), clock_(clock), work_(work), info_(camera.configure(config)) {
    camera_.start();
}

FrameSource::~FrameSource() {
    try {
        camera_.stop();
    } catch (...) {  // NOLINT(bugprone-empty-catch): the run is over, and what it got is safe
    }
}

void FrameSource::recover(Nanoseconds patience) {
    if (!failed_) return;
    camera_.stop();
    last_ = {};
    camera_.start();
    next(clock_.now() + patience);
    failed_ = false;
}

Frame FrameSource::next(TimePoint deadline) {
    while (true) {
        stop_when_asked(work_);
        try {
            return camera_.next_frame(std::min(deadline, clock_.now() + slice));
        } catch (const DeadlineError&) {
            if (clock_.now() < deadline) continue;
            failed_ = true;
            throw;
        } catch (const DeviceError&) {
            failed_ = true;
            throw;
        }
    }
}

void FrameSource::check_order(const Frame& frame, const Place& before) const {
    if (before.sequence && frame.sequence <= *before.sequence)
        throw DeviceError(
            fmt::format("frame {} came after frame {}: repeated or out of order", frame.sequence, *before.sequence),
            damaged_hint);
    if (before.timestamp && frame.timestamp <= *before.timestamp)
        throw DeviceError(fmt::format("frame {} carries a timestamp no later than the frame before it", frame.sequence),
                          "the camera's timestamps run backwards; update its driver");
    if (frame.exposure.end < frame.exposure.begin || frame.exposure.end > clock_.now())
        throw DeviceError(fmt::format("frame {} claims to be exposed in the future", frame.sequence),
                          "the camera's timestamps come from another clock; update its driver");
}

std::uint64_t FrameSource::lost_while_waiting(const Frame& frame, const Place& before, TimePoint begin) const {
    if (!before.sequence || frame.sequence <= *before.sequence + 1) return 0;
    // A quarter of a frame for the jitter of timestamps.
    const double frames = to_seconds(frame.exposure.end - begin) / info_.frame_period.count() - 0.25;
    return std::min(frame.sequence - *before.sequence - 1, static_cast<std::uint64_t>(std::max(frames, 0.0)));
}

Frame FrameSource::first_after(TimePoint earliest, TimePoint deadline) {
    const TimePoint begin = clock_.now();
    while (true) {
        Frame frame = next(deadline);
        const Place before = std::exchange(last_, Place{frame.sequence, frame.timestamp});
        lost_ += lost_while_waiting(frame, before, begin);
        if (frame.exposure.begin >= earliest) {
            check_order(frame, before);
            check_frame(frame, info_);
            return frame;
        }
        if (clock_.now() >= deadline)
            throw DeadlineError("no frame began after the lamp was steady",
                                "raise frame_deadline_s of [capture], or check the camera's timestamps");
    }
}

}  // namespace darkbox
