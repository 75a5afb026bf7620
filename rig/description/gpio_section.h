#pragma once

#include "rig/description/rig_description.h"
#include "rig/description/toml_section.h"

namespace darkbox {

/// [lamps.gpio]. Returns whether lamps are active low that do not say so themselves.
bool read_gpio(TomlSection& section, GpioDescription& gpio);

}  // namespace darkbox
