#pragma once

#include "rig/description/rig_description.h"
#include "rig/description/toml_section.h"

namespace darkbox {

/// [lamps.usb].
UsbDescription read_usb(TomlSection& section);

}  // namespace darkbox
