#pragma once

#include "rig/description/rig_description.h"
#include "rig/description/toml_section.h"

namespace darkbox {

/// [capture] of rig.toml. Throws InputError as parse_rig() does.
CaptureDescription read_capture(TomlSection& section);

}  // namespace darkbox
