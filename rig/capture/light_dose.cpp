#include "rig/capture/light_dose.h"

#include <fmt/format.h>

#include <algorithm>

namespace darkbox {
namespace {

void require_part(const std::optional<double>& limit, double spent, double more, const std::string& whose,
                  const char* unit, const char* key) {
    if (!limit || spent + more <= *limit) return;
    throw DoseExceeded(
        fmt::format("{} has had {:.4g} of {:.4g} {}, and the next light would add {:.3g}", whose, spent, *limit, unit,
                    more),
        fmt::format(
            "light does not fade: capture fewer lamps, shorten exposure_ms, or, if the object bears it, raise {} of "
            "[dose]",
            key));
}

}  // namespace

DoseExceeded::~DoseExceeded() = default;

LightDose& operator+=(LightDose& sum, const LightDose& more) {
    sum.lux_s += more.lux_s;
    sum.uv_j_per_m2 += more.uv_j_per_m2;
    sum.ir_j_per_m2 += more.ir_j_per_m2;
    return sum;
}

LightDose over(const LightDose& per_second, Seconds lit) {
    const double s = lit.count();
    return {per_second.lux_s * s, per_second.uv_j_per_m2 * s, per_second.ir_j_per_m2 * s};
}

bool knows_doses(const RigDescription& rig) {
    return std::any_of(rig.lamps.begin(), rig.lamps.end(), [](const LampDescription& lamp) {
        const LightDose& d = lamp.dose_per_s;
        return d.lux_s > 0 || d.uv_j_per_m2 > 0 || d.ir_j_per_m2 > 0;
    });
}

void require_dose(const DoseDescription& limits, const std::string& object, const LightDose& spent,
                  const LightDose& in_capture, const LightDose& more) {
    if (std::find(limits.exempt.begin(), limits.exempt.end(), object) != limits.exempt.end()) return;
    const std::string whose = object.empty() ? "the object without a name" : fmt::format("the object '{}'", object);
    require_part(limits.object_lux_s, spent.lux_s, more.lux_s, whose, "lux seconds", "object_lux_s");
    require_part(limits.object_uv_j_per_m2, spent.uv_j_per_m2, more.uv_j_per_m2, whose, "J/m2 of ultraviolet",
                 "object_uv_j_per_m2");
    require_part(limits.object_ir_j_per_m2, spent.ir_j_per_m2, more.ir_j_per_m2, whose, "J/m2 of infrared",
                 "object_ir_j_per_m2");
    require_part(limits.capture_lux_s, in_capture.lux_s, more.lux_s, whose + " in this capture", "lux seconds",
                 "capture_lux_s");
}

}  // namespace darkbox
