#pragma once

#include <functional>
#include <memory>

#include "acquisition/frame/progress.h"
#include "acquisition/frame/units.h"
#include "rig/capture/capture_session.h"
#include "rig/description/rig_description.h"
#include "rig/lamps/lamp_array.h"

namespace darkbox {

/// A capture that ended with a sealed session.
struct CaptureOutcome {
    std::filesystem::path session;
    std::size_t frames = 0;
    int resumed = 0;              ///< shots that an earlier run had acknowledged
    int repeated = 0;             ///< exposures thrown away and taken again
    std::size_t most_queued = 0;  ///< bytes of frames that waited for the disk at once
    Seconds duration{0};
    std::vector<std::string> findings = {};  ///< what looks wrong with the rig, in words
};

/// Devices, behind the door's switch where there is one.
struct LentDevices : CaptureDevices {
    /// To be called at least every 50 ms while a lamp is lit and no frame is waited for: darkens the lamps and throws
    /// DoorOpen when the door is open.
    std::function<void()> look_at_door;
};

/// A rig with its devices open, reduced to what drives it: the daemon's capture thread, or `darkbox capture
/// --standalone`. Its lamps are dark when it is made and when it is destroyed. Thread-compatible: one thread drives it.
class CaptureRig {
public:
    virtual ~CaptureRig() = default;
    /// The whole capture, sealed; throws what capture_session() throws. Lamps are dark afterwards.
    virtual CaptureOutcome capture(const CaptureRequest& request, const WorkContext& work) = 0;
    /// Lends the devices for a measurement; the lamps are dark afterwards. Throws what `work` throws.
    virtual void lend(const std::function<void(const LentDevices&)>& work) = 0;
    /// Throws DeviceError when darkness cannot be confirmed.
    virtual void dark() = 0;
    /// The lamps', while nothing is captured.
    virtual LampHealth health() { return {}; }
};

using OpenRig = std::function<std::unique_ptr<CaptureRig>()>;

}  // namespace darkbox
