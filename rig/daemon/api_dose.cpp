#include "rig/capture/dose_book.h"
#include "rig/daemon/api.h"
#include "rig/daemon/api_words.h"

namespace darkbox {
namespace {

using Json = nlohmann::json;

void add_limit(Json& limits, const char* key, const std::optional<double>& limit) {
    if (limit) limits[key] = *limit;
}

}  // namespace

/// Read anew each time: captures outside the daemon write to the same book.
ApiResponse Api::dose(const Call&) const {
    Json limits = Json::object();
    add_limit(limits, "object_lux_s", rig_.dose.object_lux_s);
    add_limit(limits, "object_uv_j_per_m2", rig_.dose.object_uv_j_per_m2);
    add_limit(limits, "object_ir_j_per_m2", rig_.dose.object_ir_j_per_m2);
    add_limit(limits, "capture_lux_s", rig_.dose.capture_lux_s);
    Json objects = Json::array();
    const DoseBook book(service_.sessions());
    for (const auto& [object, dose] : book.objects())
        objects.push_back({{"object", object},
                           {"lux_s", dose.lux_s},
                           {"uv_j_per_m2", dose.uv_j_per_m2},
                           {"ir_j_per_m2", dose.ir_j_per_m2}});
    return reply({{"limits", limits}, {"objects", objects}});
}

}  // namespace darkbox
