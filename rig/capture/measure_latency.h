#pragma once

#include <functional>
#include <optional>

#include "rig/capture/capture_run.h"

namespace darkbox {

struct LatencyOptions {
    LampId lamp;     ///< that is flipped
    int flips = 24;  ///< at moments spread over the frame period

    void validate() const;
};

/// Where exposures lie beside their timestamps, and how that was found.
struct LatencyReport {
    CameraInfo camera;
    MeasuredTiming timing;
    Seconds exposure{0};       ///< as measured; the camera's own word is in camera.controls
    Seconds told_begin{0};     ///< from the stamp to the begin of the exposure, as the driver says
    Seconds residual{0};       ///< root mean square of what the flips differ by
    std::size_t readings = 0;  ///< rows of frames that showed a part of the light
};

/// Flips a lamp at moments all over the frame period and reads from the rows of the frames when each was exposed: a row
/// that ends its exposure at `end` and was lit from `on` holds (end - on) / exposure of the light. Over all readings,
/// on - stamp = end of the first row + height * read-out - exposure * share, three unknowns, solved by least squares.
/// Believes nothing of the timestamps but that they keep a rhythm. The lamp's own delay counts as the camera's. Lamps
/// are dark afterwards. Throws DeviceError, Cancelled, and InputError when the frames do not show the lamp.
LatencyReport measure_latency(const RigDescription& rig, const CaptureDevices& devices, const LatencyOptions& options,
                              const WorkContext& work = {});

}  // namespace darkbox
