#include "rig/health/probe.h"

namespace darkbox {
namespace {

constexpr int spare_frames = 2;
constexpr double share_of_max_on = 0.9;

}  // namespace

void Probe::set_up(Seconds exposure) {
    if (source_ && exposure == exposure_) return;
    source_.reset();
    source_.emplace(devices_.camera, devices_.clock, CameraConfig{exposure, rig_.camera.gain}, work_);
    exposure_ = exposure;
}

void Probe::take(std::optional<LampId> lamp, Seconds exposure, int count,
                 const std::function<void(const Frame&)>& see) {
    set_up(exposure);
    const CameraInfo& info = source_->info();
    const Nanoseconds period = to_nanoseconds(info.frame_period);
    const TimePoint begin = devices_.clock.now();
    TimePoint last = TimePoint::max();
    TimePoint earliest = begin + period * (info.queue_depth + info.latency_frames + spare_frames);
    if (lamp) {
        const LampDescription& described = rig_.lamps.at(lamp->value);
        lamps_.light(*lamp);
        earliest += to_nanoseconds(described.settle);
        last = begin + to_nanoseconds(share_of_max_on * described.max_on) - 2 * period;
    }
    for (int taken = 0; taken < count && (taken == 0 || devices_.clock.now() < last); ++taken) {
        const Frame frame = source_->first_after(
            earliest, devices_.clock.now() + 16 * period + to_nanoseconds(rig_.capture.frame_deadline));
        earliest = frame.exposure.end;
        see(frame);
    }
    lamps_.dark();
}

Probe::Look Probe::look(std::optional<LampId> lamp, Seconds exposure) {
    Look look;
    take(lamp, exposure, 1, [&](const Frame& frame) { look = {luminance_of(frame), frame.controls.exposure}; });
    return look;
}

}  // namespace darkbox
