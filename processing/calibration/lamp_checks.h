#pragma once

#include <string>
#include <vector>

#include "processing/calibration/drift.h"

namespace darkbox {

/// Lamps that are swapped, twice in one place or far from where the rig's description has them, in words. The lights of
/// `nominal` hold directions from the object to the described positions; `position_sigma_deg` says how well rigs are
/// built to their description. A camera that looks at the rig from another side than described is allowed for where a
/// majority of lamps agrees on it. Lamps that the description does not name are passed over.
std::vector<std::string> against_nominal(const RigLights& nominal, const RigLights& calibration,
                                         double position_sigma_deg = 3.0);

/// Lamps that are dim or dead beside the median of all, in words. For lights whose intensities are known.
std::vector<std::string> weak_lamps(const Lights& lights);

}  // namespace darkbox
