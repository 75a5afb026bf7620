#pragma once

#include <filesystem>
#include <string>

#include "rig/daemon/catalog.h"

namespace darkbox {

/// From where on a drift is worth somebody's walk to the rig. What is significant but smaller is only recorded.
struct DriftAlarm {
    double moved_deg = 1.0;    ///< a lamp
    double knocked_deg = 0.5;  ///< the camera
    double dim_ratio = 0.7;    ///< of a lamp's light before, relative to the other lamps
    double blur_ratio = 1.25;  ///< of the blur at the ball before,
    double blur_px = 0.2;      ///< and by so much more
};

/// Compares the stored calibrations of two sessions. What cannot be compared says why in `alarm`.
CatalogDrift compare_calibrations(const std::filesystem::path& folder, const std::string& before,
                                  const std::string& after, const std::string& role, const DriftAlarm& alarm = {});

}  // namespace darkbox
