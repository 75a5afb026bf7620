#pragma once

#include <cstddef>
#include <optional>
#include <stop_token>
#include <string>
#include <vector>

#include "acquisition/camera/camera.h"
#include "acquisition/device/clock.h"
#include "acquisition/frame/progress.h"
#include "rig/capture/frame_sink.h"
#include "rig/capture/frame_source.h"
#include "rig/capture/taken_shot.h"
#include "rig/description/rig_description.h"
#include "rig/lamps/lamp_array.h"

namespace darkbox {

/// A validated list of shots. Those of one exposure stand together, and begin and end without a lamp.
struct CapturePlan {
    std::vector<Shot> shots;
};

/// The lamps of these names in the rig's order; empty = all. Throws InputError that names an unknown lamp and the known
/// ones.
std::vector<LampId> lamps_named(const RigDescription& rig, const std::vector<std::string>& names);

/// For each of rig.capture.brackets: a frame without a lamp, every lamp as often as rig.capture.averages says, pass
/// after pass so that what drifts drifts in all of them, a frame without a lamp between as rig.capture.dark_every says,
/// and one at the end. The first lamp once more where rig.capture.closing_repeat says so. `lamps`: names to capture;
/// empty = all. Throws InputError that names an unknown lamp and the known ones, or an exposure that a lamp does not
/// bear or that is no whole number of flicker periods.
CapturePlan plan_capture(const RigDescription& rig, const std::vector<std::string>& lamps = {});

struct CaptureSummary {
    int taken = 0;                ///< shots acknowledged by this run
    int resumed = 0;              ///< shots that an earlier run had acknowledged
    int repeated = 0;             ///< exposures thrown away and taken again
    std::size_t most_queued = 0;  ///< bytes of frames that waited for the disk at once
};

/// The devices that a run drives.
struct CaptureDevices {
    LampArray& lamps;
    Camera& camera;
    Clock& clock;
};

/// Takes every shot of the plan that the sink does not hold yet, at the speed that rig.capture.mode asks for. Each
/// frame is proven to be lit by its lamp before it goes to the sink: by its timestamps against the lamp's steady
/// interval, then by the picture (see picture_check.h, switch_witness.h). A frame without a lamp that differed from the
/// first, be it for a moment, puts all in doubt that was lit since the one before: they are withdrawn and taken again,
/// at most rig.capture.tries times. Lamps are dark when it returns or throws.
/// `timings`: where exposures lie beside their timestamps, where that was measured.
/// Throws Cancelled, DeviceError, or InputError naming lamp, frame and cause.
CaptureSummary run_capture(const CapturePlan& plan, const RigDescription& rig, const CaptureDevices& devices,
                           FrameSink& sink, const WorkContext& work = {}, const TimingLookup& timings = {});

}  // namespace darkbox
