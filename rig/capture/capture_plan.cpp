#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <set>

#include "acquisition/frame/error.h"
#include "rig/capture/capture_run.h"

namespace darkbox {
namespace {

std::vector<std::string> names_of(const std::vector<LampDescription>& lamps) {
    std::vector<std::string> names;
    for (const LampDescription& lamp : lamps) names.push_back(lamp.name);
    return names;
}

/// The wanted lamps that exist; throws at the first that does not, or that is named twice.
std::set<std::string> checked(const std::vector<std::string>& wanted, const std::vector<std::string>& known) {
    std::set<std::string> names;
    for (const std::string& name : wanted) {
        if (std::find(known.begin(), known.end(), name) == known.end())
            throw InputError(fmt::format("the rig has no lamp '{}'", name),
                             fmt::format("its lamps are: {}", fmt::join(known, ", ")));
        if (!names.insert(name).second)
            throw InputError(fmt::format("lamp '{}' is asked for twice", name), "name every lamp once");
    }
    return names;
}

Shot shot(const CapturePlan& plan, const RigDescription& rig, std::optional<LampId> lamp) {
    Shot shot;
    shot.kind = lamp ? FrameKind::lit : FrameKind::dark;
    shot.lamp = lamp;
    shot.camera = {rig.camera.exposure, rig.camera.gain};
    shot.name = fmt::format("{:04}_{}", plan.shots.size(), lamp ? rig.lamps.at(lamp->value).name : "dark");
    return shot;
}

}  // namespace

CapturePlan plan_capture(const RigDescription& rig, const std::vector<std::string>& lamps) {
    const std::vector<std::string> known = names_of(rig.lamps);
    const std::set<std::string> wanted = checked(lamps.empty() ? known : lamps, known);
    CapturePlan plan;
    plan.shots.push_back(shot(plan, rig, std::nullopt));
    for (std::uint32_t id = 0; id < rig.lamps.size(); ++id)
        if (wanted.count(rig.lamps[id].name) != 0) plan.shots.push_back(shot(plan, rig, LampId{id}));
    plan.shots.push_back(shot(plan, rig, std::nullopt));
    return plan;
}

}  // namespace darkbox
