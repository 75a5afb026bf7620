#pragma once

#include <string>
#include <vector>

namespace darkbox {

/// Which rig a calibration belongs to.
struct RigIdentity {
    std::string name;                ///< of [rig] in rig.toml; empty where photographs were imported
    std::vector<std::string> lamps;  ///< one for each light of the calibration; empty strings where not known
};

/// Why two calibrations cannot be of one rig, as a sentence; empty when they can: names that differ, or lamps that do
/// not share a single name.
std::string difference(const RigIdentity& a, const RigIdentity& b);

}  // namespace darkbox
