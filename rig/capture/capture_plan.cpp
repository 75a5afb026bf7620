#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
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

void check_exposure(Seconds exposure, const RigDescription& rig, const std::vector<LampId>& lamps) {
    for (const LampId id : lamps) {
        const LampDescription& lamp = rig.lamps.at(id.value);
        if (exposure + lamp.settle >= lamp.max_on)
            throw InputError(fmt::format("an exposure of {} ms is longer than lamp '{}' may shine: max_on_s is {}",
                                         exposure.count() * 1000, lamp.name, lamp.max_on.count()),
                             "shorten the exposure or its brackets, or raise max_on_s of the lamp if it bears that");
    }
    if (!rig.flicker_hz) return;
    constexpr double whole = 0.002;  // of a period
    const double periods = exposure.count() * *rig.flicker_hz;
    if (periods > 0.5 && std::abs(periods - std::round(periods)) <= whole) return;
    throw InputError(
        fmt::format("an exposure of {} ms is {:.3f} periods of the lamps' flicker", exposure.count() * 1000, periods),
        fmt::format("make it a whole number of periods of {} ms, or let it be metered", 1000 / *rig.flicker_hz));
}

class PlanMaker {
public:
    PlanMaker(const RigDescription& rig, FrameKind kind) : rig_(rig), kind_(kind) {}

    void add_part(Seconds exposure, const std::vector<LampId>& lamps, bool closes) {
        camera_ = {exposure, rig_.camera.gain};
        const auto every = static_cast<std::size_t>(rig_.capture.dark_every);
        const std::size_t frames = lamps.size() * static_cast<std::size_t>(rig_.capture.averages);
        add(std::nullopt);
        for (std::size_t lit = 0; lit < frames; ++lit) {
            if (every > 0 && lit > 0 && lit % every == 0) add(std::nullopt);
            add(lamps[lit % lamps.size()]);
        }
        if (closes && rig_.capture.closing_repeat) add(lamps.front());
        add(std::nullopt);
    }
    CapturePlan take() { return std::move(plan_); }

private:
    void add(std::optional<LampId> lamp) {
        const FrameKind off = rig_.capture.ambient ? FrameKind::ambient : FrameKind::dark;
        Shot shot{lamp ? kind_ : off, lamp, camera_, "", rig_.camera.format == "MJPG" ? "jpg" : "tif"};
        const std::string label = lamp ? rig_.lamps.at(lamp->value).name : std::string(darkbox::name(off));
        shot.name = fmt::format("{:04}_{}", plan_.shots.size(), label);
        plan_.shots.push_back(std::move(shot));
    }

    const RigDescription& rig_;
    const FrameKind kind_;
    CameraConfig camera_;
    CapturePlan plan_;
};

}  // namespace

std::vector<LampId> lamps_named(const RigDescription& rig, const std::vector<std::string>& names) {
    const std::vector<std::string> known = names_of(rig.lamps);
    const std::set<std::string> wanted = checked(names.empty() ? known : names, known);
    std::vector<LampId> lamps;
    for (std::uint32_t id = 0; id < rig.lamps.size(); ++id)
        if (wanted.contains(rig.lamps[id].name)) lamps.push_back(LampId{id});
    return lamps;
}

CapturePlan plan_capture(const RigDescription& rig, const std::vector<std::string>& names, FrameKind kind) {
    const std::vector<LampId> lamps = lamps_named(rig, names);
    PlanMaker maker(rig, kind);
    const std::vector<double>& brackets = rig.capture.brackets;
    for (std::size_t i = 0; i < brackets.size(); ++i) {
        const Seconds exposure = brackets[i] * rig.camera.exposure;
        check_exposure(exposure, rig, lamps);
        maker.add_part(exposure, lamps, i + 1 == brackets.size());
    }
    return maker.take();
}

}  // namespace darkbox
