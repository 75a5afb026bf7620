#include "processing/calibration/lamp_checks.h"

#include <fmt/format.h>

#include <algorithm>

namespace darkbox {
namespace {

constexpr double false_alarm = 1e-3;
constexpr double dim = 0.5;  // of the median lamp; lamps of one make differ by less
constexpr double dead = 0.05;

double median_intensity(const Lights& lights) {
    std::vector<double> all;
    for (const Light& light : lights)
        if (light.used) all.push_back(light.intensity.mean());
    if (all.empty()) return 0;
    const auto middle = all.begin() + static_cast<std::ptrdiff_t>(all.size() / 2);
    std::nth_element(all.begin(), middle, all.end());
    return *middle;
}

/// A finding in terms of the description rather than of an earlier calibration.
std::string in_words(const LampDrift& lamp) {
    if (lamp.finding == LampFinding::swapped)
        return fmt::format("{} shines from where the rig's description has {}: are they swapped?", lamp.lamp,
                           lamp.partner);
    if (lamp.finding == LampFinding::duplicate)
        return fmt::format("{} and {} shine from the same place, against the rig's description", lamp.lamp,
                           lamp.partner);
    return fmt::format("{} is {:.1f} degrees from where the rig's description has it", lamp.lamp, lamp.moved_deg);
}

}  // namespace

std::vector<std::string> against_nominal(const RigLights& nominal, const RigLights& calibration,
                                         double position_sigma_deg) {
    DriftOptions options;
    options.unknown_sigma_deg = position_sigma_deg;
    options.same_place_deg = 3 * position_sigma_deg;
    options.false_alarm = false_alarm;
    options.other_rig = OtherRig::compare;
    if (!difference(nominal.rig, calibration.rig).empty()) return {};
    RigLights directions = calibration;  // at the object, as the description's are
    for (Light& light : directions.lights) light.near.reset();
    std::vector<std::string> words;
    for (const LampDrift& lamp : drift_between(nominal, directions, options).lamps)
        if (lamp.finding == LampFinding::swapped || lamp.finding == LampFinding::duplicate ||
            lamp.finding == LampFinding::moved)
            words.push_back(in_words(lamp));
    return words;
}

std::vector<std::string> weak_lamps(const Lights& lights) {
    std::vector<std::string> words;
    const double median = median_intensity(lights);
    if (!(median > 0)) return words;
    for (const Light& light : lights) {
        const double share = light.intensity.mean() / median;
        if (light.used && share < dead)
            words.push_back(
                fmt::format("the lamp of {} is dead: {:.1f} % of the median lamp", light.file, 100 * share));
        else if (light.used && share < dim)
            words.push_back(fmt::format("the lamp of {} is dim: {:.0f} % of the median lamp", light.file, 100 * share));
    }
    return words;
}

}  // namespace darkbox
