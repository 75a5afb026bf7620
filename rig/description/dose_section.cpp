#include "rig/description/dose_section.h"

#include <fmt/format.h>

#include <algorithm>

namespace darkbox {

LightDose read_lamp_dose(TomlSection& lamp) {
    return {lamp.number("illuminance_lux", {0, 10'000'000}).value_or(0),
            lamp.number("uv_w_per_m2", {0, 10'000}).value_or(0), lamp.number("ir_w_per_m2", {0, 10'000}).value_or(0)};
}

DoseDescription read_dose(TomlSection& section, const std::vector<LampDescription>& lamps) {
    section.allow({"object_lux_s", "object_uv_j_per_m2", "object_ir_j_per_m2", "capture_lux_s", "exempt"});
    DoseDescription dose;
    dose.object_lux_s = section.number("object_lux_s", {0.001, 1e12});
    dose.object_uv_j_per_m2 = section.number("object_uv_j_per_m2", {0.001, 1e12});
    dose.object_ir_j_per_m2 = section.number("object_ir_j_per_m2", {0.001, 1e12});
    dose.capture_lux_s = section.number("capture_lux_s", {0.001, 1e12});
    if (section.has("exempt")) dose.exempt = section.texts_or_digits("exempt");
    const auto require = [&](const char* key, const char* lamp_key, double LightDose::* part) {
        for (const LampDescription& lamp : lamps)
            if (section.has(key) && !(lamp.dose_per_s.*part > 0))
                section.fail(key, fmt::format("has {}, but lamp '{}' has no {}", key, lamp.name, lamp_key),
                             fmt::format("measure each lamp at the object's place and give its {}", lamp_key));
    };
    require("object_lux_s", "illuminance_lux", &LightDose::lux_s);
    require("capture_lux_s", "illuminance_lux", &LightDose::lux_s);
    require("object_uv_j_per_m2", "uv_w_per_m2", &LightDose::uv_j_per_m2);
    require("object_ir_j_per_m2", "ir_w_per_m2", &LightDose::ir_j_per_m2);
    return dose;
}

}  // namespace darkbox
