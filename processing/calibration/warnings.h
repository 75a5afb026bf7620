#pragma once

#include <string>
#include <vector>

#include "processing/calibration/calibration.h"

namespace darkbox {

/// What a person should know about a calibration before trusting it, in sentences: lights that
/// nearly share a plane or a direction, an outline that is not a circle.
std::vector<std::string> warnings_about(const Calibration& calibration);

}  // namespace darkbox
