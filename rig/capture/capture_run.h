#pragma once

#include <optional>
#include <stop_token>
#include <string>
#include <vector>

#include "acquisition/camera/camera.h"
#include "acquisition/device/clock.h"
#include "acquisition/frame/progress.h"
#include "acquisition/session/session_writer.h"
#include "rig/description/rig_description.h"
#include "rig/lamps/lamp_array.h"

namespace darkbox {

/// One picture to take.
struct Shot {
    FrameKind kind = FrameKind::lit;
    std::optional<LampId> lamp;  ///< none: all dark
    CameraConfig camera;
    std::string name;  ///< of the file: "0003_lamp-04"
};

/// A validated list of shots: dark, every lamp, dark again.
struct CapturePlan {
    std::vector<Shot> shots;
    bool closing_dark_differs_is_error = true;
};

/// `lamps`: names to capture; empty = all. Throws InputError that names an unknown lamp and the known ones.
CapturePlan plan_capture(const RigDescription& rig, const std::vector<std::string>& lamps = {});

struct CaptureSummary {
    int taken = 0;     ///< shots acknowledged by this run
    int resumed = 0;   ///< shots that an earlier run had acknowledged
    int repeated = 0;  ///< exposures thrown away and taken again
};

/// Takes every shot of the plan that the writer does not hold yet; each frame is proven to be lit by its lamp before it
/// is acknowledged: by its timestamps against the lamp's steady interval, then by the picture (see picture_check.h),
/// which a second exposure under the same lamp confirms. Lamps are dark when it returns or
/// throws. Does not seal. Throws Cancelled, DeviceError, or InputError naming lamp, frame and cause.
CaptureSummary run_capture(const CapturePlan& plan, const RigDescription& rig, LampArray& lamps, Camera& camera,
                           Clock& clock, SessionWriter& writer, const WorkContext& work = {});

}  // namespace darkbox
