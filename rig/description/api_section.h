#pragma once

#include "rig/description/rig_description.h"
#include "rig/description/toml_section.h"

namespace darkbox {

/// [api].
void read_api(TomlSection& section, RigDescription& rig);

}  // namespace darkbox
