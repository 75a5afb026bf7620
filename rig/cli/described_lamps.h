#pragma once

#include <filesystem>
#include <optional>

#include "processing/calibration/drift.h"

namespace darkbox {

/// Where the description that a session was captured with (data/rig.toml) has the lamps, as directions from the object.
/// None for imported sessions, and for a description that this version cannot read: it serves warnings only.
std::optional<RigLights> described_lamps(const std::filesystem::path& session);

}  // namespace darkbox
