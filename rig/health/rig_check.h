#pragma once

#include "rig/capture/capture_run.h"
#include "rig/health/rig_report.h"

namespace darkbox {

/// The limits of rig.md, and how much is measured.
struct RigCheckOptions {
    double most_deviation = 0.01;   ///< from linearity, share of the largest signal
    double most_flicker = 0.002;    ///< standard deviation over the mean, from exposure to exposure
    double most_leak = 0.005;       ///< share of a lamp's light that another lamp's frame, or the dark one, may hold
    double least_lamp = 0.7;        ///< a lamp's light, share of the lamps' median
    double most_blur_px = 1.5;      ///< standard deviation, at the sharpest edges
    double most_clipped = 0.001;    ///< share of the pixels off the ball
    double most_movement_px = 0.3;  ///< between the first and the last frame
    int frames = 16;                ///< of each lamp

    void validate() const;
};

/// Measures a rig with an object and, for leaks, a mirror ball in place: every lamp's frames at the exposure of
/// rig.toml (flicker, dead and dim lamps, clipping), the ball under each in a thirty-second of it (leaks), a sweep of
/// the exposure under the lamp that shows most (linearity, focus), at last the first lamp once more (movement). Lamps
/// are dark afterwards. Throws InputError, DeviceError, Cancelled.
RigReport check_rig(const RigDescription& rig, const CaptureDevices& devices, const RigCheckOptions& options,
                    const WorkContext& work = {});

}  // namespace darkbox
