#pragma once

#include <string>
#include <vector>

#include "rig/capture/capture_run.h"

namespace darkbox {

/// What metering found.
struct Metering {
    Seconds exposure{0};
    double level = 0;  ///< share of full scale that the object reaches under its brightest lamp
    std::string lamp;  ///< that one
    int frames = 0;    ///< taken for it, and thrown away

    std::string words() const;
};

/// Looks for the exposure at which the object's 99.9th percentile under the brightest of the lamps lies at 80 to 90 %
/// of full scale; a mirror ball's highlights may clip. It keeps to what the camera and the lamps' max_on_s allow, and
/// is a whole number of periods of rig.flicker_hz: the most that stays below 90 %, where none lies in between. Begins
/// at rig.camera.exposure. The camera is left stopped, the lamps dark. Throws InputError when the object is too dark or
/// too bright for any exposure, DeviceError, Cancelled.
Metering meter_exposure(const RigDescription& rig, const std::vector<LampId>& lamps, const CaptureDevices& devices,
                        const WorkContext& work = {}, const TimingLookup& timings = {});

}  // namespace darkbox
