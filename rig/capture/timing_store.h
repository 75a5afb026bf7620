#pragma once

#include <filesystem>
#include <optional>

#include "rig/capture/measure_latency.h"

namespace darkbox {

/// Where measured timings are kept from one capture to the next: $DARKBOX_STATE, the folder that systemd gives, else
/// $XDG_STATE_HOME/darkbox or ~/.local/state/darkbox; timing.json in it.
std::filesystem::path default_timing_file();

/// Keeps what was measured, in the place of an earlier measurement of the same camera, mode, exposure and driver.
/// Throws DeviceError when the file cannot be written.
void store_timing(const std::filesystem::path& file, const LatencyReport& report);

/// What was measured of this camera in this mode, at this exposure and by this driver; none where nothing was. Throws
/// InputError for a file that is no such store.
std::optional<MeasuredTiming> stored_timing(const std::filesystem::path& file, const CameraInfo& camera);

}  // namespace darkbox
