#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "processing/calibration/calibration.h"

namespace darkbox {

/// calibration/lights.json: lights with sigma, intensity and highlight, balls, condition number, method, warnings.
/// `lamps` names the lamp of each light and may be empty.
void write_calibration(const std::filesystem::path& path, const Calibration& calibration,
                       const std::vector<std::string>& lamps);

struct StoredCalibration {
    Calibration calibration;
    std::vector<std::string> lamps;  ///< one per light; empty strings where not known
};
/// Throws InputError that names the file when it is missing or is not a calibration.
StoredCalibration read_calibration(const std::filesystem::path& path);

}  // namespace darkbox
