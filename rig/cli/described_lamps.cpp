#include "rig/cli/described_lamps.h"

#include "acquisition/frame/error.h"
#include "rig/description/rig_description.h"

namespace darkbox {
namespace {

RigLights lights_of(const RigDescription& rig) {
    RigLights described{{rig.name, {}}, {}, false};
    for (const LampDescription& lamp : rig.lamps) {
        Light light;
        light.file = lamp.name;
        light.direction = Eigen::Vector3d(lamp.position_mm[0], lamp.position_mm[1], lamp.position_mm[2]).normalized();
        described.rig.lamps.push_back(lamp.name);
        described.lights.push_back(light);
    }
    return described;
}

}  // namespace

std::optional<RigLights> described_lamps(const std::filesystem::path& session) {
    const std::filesystem::path file = session / "data/rig.toml";
    if (!std::filesystem::exists(file)) return std::nullopt;
    try {
        return lights_of(load_rig(file));
    } catch (const InputError&) {
        return std::nullopt;
    }
}

}  // namespace darkbox
