#include "tests/hil/rig_text.h"

#include <fmt/format.h>

#include "rig/description/rig_description.h"

namespace darkbox::test {

std::string rig_toml(const RigText& rig) {
    std::string toml = fmt::format(R"([rig]
name = "machine"
[camera]
driver = "v4l2"
device = "{}"
{}
{}
[lamps]
driver = "gpio"
distant = true
[lamps.gpio]
chip = "{}"
)",
                                   rig.device, rig.camera, rig.extra, rig.chip);
    const RigDescription simulated = parse_rig(simulated_rig_toml(rig.lamps), "simulated rig");
    for (std::size_t i = 0; i < simulated.lamps.size(); ++i)
        toml += fmt::format("[[lamps.lamp]]\nname = \"{}\"\nline = \"{}\"\nmax_on_s = 20\nposition_mm = [{}]\n",
                            simulated.lamps[i].name, i, fmt::join(simulated.lamps[i].position_mm, ", "));
    return toml;
}

}  // namespace darkbox::test
