#pragma once

#include "rig/description/rig_description.h"
#include "rig/description/toml_section.h"

namespace darkbox {

/// A lamp's keys that tell what it does to the object.
inline const std::set<std::string> lamp_dose_keys{"illuminance_lux", "uv_w_per_m2", "ir_w_per_m2"};
LightDose read_lamp_dose(TomlSection& lamp);

/// [dose]; a budget that no lamp's keys say anything of is an InputError.
DoseDescription read_dose(TomlSection& section, const std::vector<LampDescription>& lamps);

}  // namespace darkbox
