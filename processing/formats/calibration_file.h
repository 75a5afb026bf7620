#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "processing/calibration/calibration.h"
#include "processing/calibration/rig_identity.h"

namespace darkbox {

/// calibration/lights.json: the rig's identity, lights with sigma, intensity and highlight, balls, condition number,
/// method, warnings.
void write_calibration(const std::filesystem::path& path, const Calibration& calibration, const RigIdentity& rig);

struct StoredCalibration {
    Calibration calibration;
    RigIdentity rig;  ///< lamps: one per light; empty strings where not known
};
/// Throws InputError that names the file when it is missing or is not a calibration.
StoredCalibration read_calibration(const std::filesystem::path& path);

}  // namespace darkbox
