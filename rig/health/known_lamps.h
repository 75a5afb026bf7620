#pragma once

#include <filesystem>
#include <optional>

#include "rig/health/lamp_places.h"

namespace darkbox {

/// As rig.toml has them: built to some centimetres, and the camera may look from another side than the drawing has it.
KnownLamps described_lamps(const RigDescription& rig);

/// As the latest calibration of this rig in a folder of sessions has them, by its own mirror ball. Left out are
/// sessions named `except`, those of other lamps, and those that hold frames which were not verified: theirs may be the
/// lamps that are exchanged. No value where there is none.
std::optional<KnownLamps> calibrated_lamps(const std::filesystem::path& sessions, const RigDescription& rig,
                                           const std::string& except);

}  // namespace darkbox
