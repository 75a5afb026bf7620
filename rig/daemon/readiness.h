#pragma once

#include <optional>

#include "rig/daemon/capture_rig.h"

namespace darkbox {

/// Whether a rig is fit for a capture to begin, by [health] of rig.toml. Thread-compatible.
class Readiness {
public:
    explicit Readiness(const HealthDescription& rules) : rules_(rules) {}

    /// Waits for the camera where that is the rule. What the session is to keep of it is noted in the request. Throws
    /// InputError that says what is not fit and what to do, DeviceError, Cancelled.
    void require(const RigDescription& rig, const CaptureDevices& devices, CaptureRequest& request,
                 const WorkContext& work);
    /// The camera has been at work until now: it stays warm for a while.
    void used(TimePoint now) { used_ = now; }

private:
    void require_cool(LampArray& lamps) const;
    void require_warm(const RigDescription& rig, const CaptureDevices& devices, CaptureRequest& request,
                      const WorkContext& work);

    const HealthDescription rules_;
    std::optional<TimePoint> used_;
};

}  // namespace darkbox
