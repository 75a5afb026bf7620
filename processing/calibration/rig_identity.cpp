#include "processing/calibration/rig_identity.h"

#include <fmt/format.h>

#include <algorithm>

namespace darkbox {

std::string difference(const RigIdentity& a, const RigIdentity& b) {
    if (!a.name.empty() && !b.name.empty() && a.name != b.name)
        return fmt::format("one calibration is of the rig '{}', the other of '{}'", a.name, b.name);
    const bool shared = std::any_of(a.lamps.begin(), a.lamps.end(), [&](const std::string& lamp) {
        return !lamp.empty() && std::find(b.lamps.begin(), b.lamps.end(), lamp) != b.lamps.end();
    });
    return shared ? "" : "the two calibrations do not share the name of a single lamp";
}

}  // namespace darkbox
