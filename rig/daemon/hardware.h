#pragma once

#include <memory>

#include "acquisition/camera/camera.h"
#include "rig/daemon/capture_rig.h"

namespace darkbox {

/// Opens the devices that the description asks for; after a simulated capture, what is true of it lies in the session's
/// truth/. The one place that knows the simulator and the real drivers at once. Throws InputError for a driver that
/// this build does not have, DeviceError when a device cannot be opened.
std::unique_ptr<CaptureRig> open_hardware(const RigDescription& rig);

/// Opens the camera of the description alone, sets it up as for a capture, and tells what is in effect. Throws what
/// open_hardware() throws, and InputError for settings that the camera cannot do.
CameraInfo check_camera(const RigDescription& rig);

}  // namespace darkbox
