#pragma once

#include <functional>
#include <optional>

#include "rig/capture/capture_run.h"
#include "rig/capture/frame_source.h"
#include "rig/capture/timed_lamps.h"
#include "rig/health/luminance.h"

namespace darkbox {

/// Takes frames of the rig in steady light, at any exposure. Believes no timestamp: whatever the camera may have held
/// back is waited for. The lamps are dark between its calls and afterwards. Thread-compatible.
class Probe {
public:
    /// All references must outlive this.
    Probe(const RigDescription& rig, const CaptureDevices& devices, const WorkContext& work)
        : rig_(rig), devices_(devices), work_(work), lamps_(devices.lamps, devices.clock, rig) {}

    /// Up to `count` frames in a row under one lamp (none: in the dark), fewer where the lamp may not burn so long, but
    /// at least one. Throws DeviceError, Cancelled, InputError.
    void take(std::optional<LampId> lamp, Seconds exposure, int count, const std::function<void(const Frame&)>& see);

    /// One of them, and the exposure that was in effect.
    struct Look {
        Luminance picture;
        Seconds exposure{0};
    };
    Look look(std::optional<LampId> lamp, Seconds exposure);

private:
    void set_up(Seconds exposure);

    const RigDescription& rig_;
    const CaptureDevices& devices_;
    const WorkContext& work_;
    Seconds exposure_{0};
    std::optional<FrameSource> source_;
    TimedLamps lamps_;  // last: dark before a camera that may hang is stopped
};

}  // namespace darkbox
