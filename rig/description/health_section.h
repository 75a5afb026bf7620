#pragma once

#include "rig/description/health_description.h"
#include "rig/description/toml_section.h"

namespace darkbox {

/// [health]; `lamps_driver` tells whether the lamps have a thermometer.
HealthDescription read_health(TomlSection& section, const std::string& lamps_driver);

}  // namespace darkbox
