#pragma once

#include <string>

#include "rig/capture/capture_run.h"

namespace darkbox {

/// How a camera's dark level behaves: a sensor's temperature moves it for minutes after it was switched on.
struct WarmUp {
    bool steady = false;
    double per_minute = 0;  ///< change of the dark level, share of full scale; with its sign
    double sigma = 0;       ///< its standard deviation
    Seconds watched{0};

    /// "the camera's dark level changes by 0.00012 of full scale a minute, after 35 s"
    std::string words() const;
};

struct WarmUpOptions {
    double steady_level = 0.0005;  ///< share of full scale a minute; the change and twice its deviation must stay below
    Seconds window{10};            ///< over which a change is judged
    Seconds longest{600};          ///< the watch ends when it is over, steady or not; at least a window is watched

    void validate() const;
};

/// Looks at the dark level in the dark, once a second, until it is steady over a window; the lamps stay dark. Says its
/// progress. Throws InputError, DeviceError, Cancelled.
WarmUp watch_warm_up(const RigDescription& rig, const CaptureDevices& devices, const WarmUpOptions& options,
                     const WorkContext& work = {});

}  // namespace darkbox
