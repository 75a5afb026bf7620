#pragma once

#include "rig/description/rig_description.h"
#include "rig/description/toml_section.h"

namespace darkbox {

/// [lamps], with its drivers' sections and every lamp; camera and scene of `rig` are there already.
void read_lamps(TomlSection& section, RigDescription& rig);

}  // namespace darkbox
