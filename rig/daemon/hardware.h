#pragma once

#include <memory>
#include <optional>

#include "acquisition/camera/camera.h"
#include "rig/daemon/capture_rig.h"
#include "rig/lamps/door.h"
#include "rig/lamps/lamp_array.h"
#include "rig/lamps/lamp_guardian.h"

namespace darkbox {

/// The devices that a description asks for: the one place that knows the simulator and the real drivers at once. The
/// constructor opens none of them, but connects to the guardian of GPIO lamps, or forks one where none runs, so it must
/// run before any thread starts that does more than wait for signals. Thread-compatible; outlives what it opened.
class Hardware {
public:
    /// Throws DeviceError when the guardian that runs does not want it.
    explicit Hardware(const RigDescription& rig);

    /// Lamps and camera; after a simulated capture, what is true of it lies in the session's truth/. Throws InputError
    /// for a driver that this build does not have, DeviceError when a device cannot be opened.
    std::unique_ptr<CaptureRig> open();
    /// The lamps alone, dark. Throws as open(), and InputError for simulated lamps, which no one could see.
    std::unique_ptr<LampArray> open_lamps();
    /// The switch at the door; null where there is none, or a simulated camera. Throws DeviceError.
    std::unique_ptr<Door> open_door() const;

private:
    const RigDescription rig_;
    std::optional<LampGuardian> guardian_;
};

/// Opens the camera of the description alone, sets it up as for a capture, and tells what is in effect. Throws what
/// Hardware::open() throws, and InputError for settings that the camera cannot do.
CameraInfo check_camera(const RigDescription& rig);

}  // namespace darkbox
