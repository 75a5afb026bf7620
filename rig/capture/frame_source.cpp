#include "rig/capture/frame_source.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "acquisition/device/device_error.h"
#include "rig/capture/picture.h"

namespace darkbox {
namespace {

/// How long a wait for the camera goes without a look at whether the user wants to stop.
constexpr Nanoseconds slice = std::chrono::milliseconds(50);
/// Exposure and gain are read back from hardware in steps of its own.
constexpr double control_tolerance = 0.001;

/// More than a queue is deep.
constexpr std::size_t pictures_kept = 40;
/// A stamp may be late, and the exposure seem to end that much later: this part of a period.
constexpr int late_stamps = 20;

[[noreturn]] void throw_none_began(int frames) {
    throw DeadlineError(fmt::format("{} frames came, none of which began after the lamp was steady", frames),
                        "raise frame_deadline_s of [capture] for a slow camera, or check its timestamps");
}

constexpr const char* damaged_hint = "check the camera's cable and the load on its bus";

bool near(double a, double b) { return std::abs(a - b) <= control_tolerance * std::max(std::abs(a), std::abs(b)); }

bool same_controls(const FrameControls& a, const FrameControls& b) {
    return near(a.exposure.count(), b.exposure.count()) && near(a.gain, b.gain);
}

}  // namespace

void stop_when_asked(const WorkContext& work) {
    if (work.cancelled())
        throw Cancelled("the capture was cancelled", "every acknowledged frame is kept: resume the session to go on");
}

void check_frame(const Frame& frame, const CameraInfo& camera) {
    if (frame.status != FrameStatus::good)
        throw DamagedFrame(fmt::format("frame {} is flagged as {} by the camera's driver", frame.sequence,
                                       frame.status == FrameStatus::error ? "damaged" : "truncated"),
                           damaged_hint);
    const std::size_t wanted = static_cast<std::size_t>(camera.width) * static_cast<std::size_t>(camera.height) *
                               static_cast<std::size_t>(channels(camera.format) * bytes_per_sample(camera.format));
    if (frame.width != camera.width || frame.height != camera.height || frame.format != camera.format ||
        frame.bit_depth != camera.bit_depth)
        throw DamagedFrame(fmt::format("frame {} is {}x{} {} of {} bits, but the camera is set to {}x{} {} of {} bits",
                                       frame.sequence, frame.width, frame.height, name(frame.format), frame.bit_depth,
                                       camera.width, camera.height, name(camera.format), camera.bit_depth),
                           "another program may have changed the camera's format; stop it first");
    if (frame.pixels.size() != wanted)
        throw DamagedFrame(
            fmt::format("frame {} is truncated: {} of {} bytes", frame.sequence, frame.pixels.size(), wanted),
            damaged_hint);
    if (!same_controls(frame.controls, camera.controls))
        throw DamagedFrame(fmt::format("frame {} was exposed for {} s at gain {}, not for {} s at gain {}",
                                       frame.sequence, frame.controls.exposure.count(), frame.controls.gain,
                                       camera.controls.exposure.count(), camera.controls.gain),
                           "another program may have changed the camera's controls; stop it first");
}

FrameSource::FrameSource(Camera& camera, Clock& clock, const CameraConfig& config, const WorkContext& work,
                         const TimingLookup& timings)
    : camera_(camera),
      clock_(clock),
      work_(work),
      info_(camera.configure(config)),
      measured_(timings ? timings(info_) : std::nullopt),
      rhythm_(info_, measured_) {
    if (measured_) info_.readout = Seconds(measured_->readout);
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
    rhythm_.restart();
    since_start_ = 0;
    passed_over_.reset();
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

/// A camera that delivers too slowly is not one that hangs, and its user needs to know which.
Frame FrameSource::next_of_several(TimePoint deadline, int passed_over) {
    try {
        return next(deadline);
    } catch (const DeadlineError&) {
        throw_none_began(passed_over);
    }
}

void FrameSource::check_order(const Frame& frame, const Place& before) const {
    if (before.sequence && frame.sequence <= *before.sequence)
        throw DamagedFrame(
            fmt::format("frame {} came after frame {}: repeated or out of order", frame.sequence, *before.sequence),
            damaged_hint);
    if (before.timestamp && frame.timestamp <= *before.timestamp)
        throw DamagedFrame(
            fmt::format("frame {} carries a timestamp no later than the frame before it", frame.sequence),
            "the camera's timestamps run backwards; update its driver");
}

void FrameSource::check_present(const Frame& frame) const {
    const TimePoint now = clock_.now();
    if (frame.exposure.end < frame.exposure.begin || frame.timestamp > now ||
        told_end_ > now + rhythm_.period() / late_stamps)
        throw DamagedFrame(fmt::format("frame {} claims to be exposed in the future", frame.sequence),
                           "the camera's timestamps come from another clock; update its driver");
}

std::uint64_t FrameSource::lost_while_waiting(const Frame& frame, const Place& before, TimePoint begin) const {
    if (!before.sequence || frame.sequence <= *before.sequence + 1) return 0;
    // A quarter of a frame for the jitter of timestamps.
    const double frames = to_seconds(frame.exposure.end - begin) / info_.frame_period.count() - 0.25;
    return std::min(frame.sequence - *before.sequence - 1, static_cast<std::uint64_t>(std::max(frames, 0.0)));
}

FrameSource::Place FrameSource::take_in(Frame& frame) {
    const Place before = std::exchange(last_, Place{frame.sequence, frame.timestamp});
    in_rhythm_ = rhythm_.follow(frame);
    // The rhythm's prediction takes the longest bound that a driver told; what it told of this frame was cut off at the
    // present, and is what may not lie beyond it.
    told_end_ = measured_ ? rhythm_.exposure_of(frame).end : frame.exposure.end;
    frame.exposure = rhythm_.locked() && in_rhythm_ ? rhythm_.predicted(frame.sequence) : rhythm_.exposure_of(frame);
    note_picture(frame);
    ++since_start_;
    return before;
}

bool FrameSource::has_old_controls(const Frame& frame) const {
    return since_start_ <= info_.latency_frames && !same_controls(frame.controls, info_.controls);
}

/// Whether the frame holds next to no light: sensors without noise give one dark frame like another.
bool FrameSource::is_dark(const Frame& frame) const {
    constexpr std::size_t step = 32;  // bytes
    constexpr double least_share = 0.002;
    double sum = 0, count = 0;
    const bool wide = bytes_per_sample(frame.format) == 2;
    for (std::size_t i = 0; i + 1 < frame.pixels.size(); i += step, ++count)
        sum += std::to_integer<int>(frame.pixels[i]) + (wide ? 256 * std::to_integer<int>(frame.pixels[i + 1]) : 0);
    return count == 0 || sum / count - frame.black_level < least_share * std::exp2(frame.bit_depth);
}

void FrameSource::note_picture(const Frame& frame) {
    repeated_.reset();
    if (is_dark(frame)) return;
    const std::uint64_t hash = hash_of(frame.pixels);
    for (const auto& [sequence, earlier] : pictures_)
        if (earlier == hash) repeated_ = sequence;
    if (repeated_) ++repeats_;
    pictures_.emplace_back(frame.sequence, hash);
    if (pictures_.size() > pictures_kept) pictures_.pop_front();
}

Frame FrameSource::first_after(TimePoint earliest, TimePoint deadline) {
    const TimePoint begin = clock_.now();
    passed_over_.reset();
    for (int passed_over = 0;; ++passed_over) {
        Frame frame = passed_over == 0 ? next(deadline) : next_of_several(deadline, passed_over);
        const Place before = take_in(frame);
        lost_ += lost_while_waiting(frame, before, begin);
        const Nanoseconds margin = rhythm_.locked() ? rhythm_.margin() : rhythm_.doubt();
        if (frame.exposure.begin >= earliest + margin) check_order(frame, before);
        if (in_rhythm_ && frame.exposure.begin >= earliest + margin && !has_old_controls(frame)) {
            check_present(frame);
            check_frame(frame, info_);
            if (passed_over_ && passed_over_->sequence + 1 != frame.sequence) passed_over_.reset();
            return frame;
        }
        if (clock_.now() >= deadline) throw_none_began(passed_over + 1);
        passed_over_ = std::move(frame);
    }
}

std::optional<Frame> FrameSource::take_passed_over() {
    std::optional<Frame> frame = std::exchange(passed_over_, std::nullopt);
    if (!frame) return std::nullopt;
    try {
        check_frame(*frame, info_);
    } catch (const DeviceError&) {
        return std::nullopt;
    }
    return frame;
}

std::optional<Frame> FrameSource::next_until(TimePoint moment) {
    const TimePoint begin = clock_.now();
    std::optional<Frame> frame;
    while (!frame) {
        stop_when_asked(work_);
        try {
            frame = camera_.next_frame(std::min(moment, clock_.now() + slice));
        } catch (const DeadlineError&) {
            if (clock_.now() >= moment) return std::nullopt;
        } catch (const DeviceError&) {
            failed_ = true;
            throw;
        }
    }
    const Place before = take_in(*frame);
    lost_ += lost_while_waiting(*frame, before, begin);
    check_order(*frame, before);
    if (in_rhythm_) check_present(*frame);
    if (!has_old_controls(*frame)) check_frame(*frame, info_);
    return frame;
}

bool FrameSource::find_rhythm(TimePoint deadline) {
    while (!rhythm_.locked() || !in_rhythm_) {
        if (clock_.now() >= deadline) return false;
        try {
            next_until(deadline);
        } catch (const DamagedFrame&) {  // NOLINT(bugprone-empty-catch): the next may be good
        }
    }
    return true;
}

}  // namespace darkbox
