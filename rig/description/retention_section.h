#pragma once

#include "rig/description/rig_description.h"
#include "rig/description/toml_section.h"

namespace darkbox {

/// [retention].
RetentionRules read_retention(TomlSection& section);

}  // namespace darkbox
