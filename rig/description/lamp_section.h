#pragma once

#include "rig/description/rig_description.h"
#include "rig/description/toml_section.h"

namespace darkbox {

inline constexpr std::size_t most_lamps = 64;

/// The key that says which output of the driver a lamp hangs on.
std::string output_key(const RigDescription& rig);

/// One [[lamps.lamp]]; camera and driver of `rig` are there already. `active_low`: where the lamp does not say.
LampDescription read_lamp(TomlSection& section, const RigDescription& rig, bool active_low);

}  // namespace darkbox
