#pragma once

#include "rig/description/rig_description.h"
#include "rig/description/toml_section.h"

namespace darkbox {

/// [door]; the drivers of camera and lamps of `rig` are there already.
DoorDescription read_door(TomlSection& section, const RigDescription& rig);

}  // namespace darkbox
