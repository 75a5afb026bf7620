#include "processing/calibration/drift_words.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

namespace darkbox {
namespace {

constexpr std::array gravest_first{LampFinding::dead,  LampFinding::swapped, LampFinding::duplicate,
                                   LampFinding::moved, LampFinding::dim,     LampFinding::unread};

std::string in_words(const CameraKnock& knock, std::size_t lamps) {
    return fmt::format(
        "the camera was knocked, or the dome as a whole: {} of {} lamps turned together by {:.2f} degrees "
        "about ({:.2f}, {:.2f}, {:.2f})",
        knock.lamps, lamps, knock.angle_deg, knock.axis.x(), knock.axis.y(), knock.axis.z());
}

std::string uncertainty(const LampDrift& lamp) {
    return fmt::format("{} {:.2g}",
                       lamp.sigma_assumed ? "its uncertainty is not known and was taken as" : "uncertainty",
                       lamp.sigma_deg);
}

/// Nothing where a lamp is distant, or its distance is not known well enough to speak of.
std::string distance_in_words(const LampDrift& lamp) {
    if (!lamp.farther_mm || !(std::abs(*lamp.farther_mm) > 2 * lamp.farther_sigma_mm && lamp.farther_sigma_mm > 0))
        return {};
    return fmt::format(" and stands {:.0f} mm {} (uncertainty {:.2g})", std::abs(*lamp.farther_mm),
                       *lamp.farther_mm > 0 ? "farther" : "nearer", lamp.farther_sigma_mm);
}

bool mutual(const LampDrift& lamp, const std::vector<LampDrift>& lamps) {
    return std::any_of(lamps.begin(), lamps.end(), [&](const LampDrift& other) {
        return other.lamp == lamp.partner && other.partner == lamp.lamp && other.finding == lamp.finding;
    });
}

std::string swap_in_words(const LampDrift& lamp, const std::vector<LampDrift>& lamps) {
    if (mutual(lamp, lamps))
        return fmt::format("{} and {} are swapped: each shines from where the other was", lamp.lamp, lamp.partner);
    return fmt::format("{} shines from where {} was: lamps are named in another order", lamp.lamp, lamp.partner);
}

std::string in_words(const LampDrift& lamp, const std::vector<LampDrift>& lamps) {
    switch (lamp.finding) {
        case LampFinding::moved: {
            const std::string where = lamp.partner.empty() ? "" : fmt::format(" to where {} was", lamp.partner);
            return fmt::format("{} moved by {:.2f} degrees{} ({}){}", lamp.lamp, lamp.moved_deg, where,
                               uncertainty(lamp), distance_in_words(lamp));
        }
        case LampFinding::swapped:
            return swap_in_words(lamp, lamps);
        case LampFinding::duplicate:
            return fmt::format("{} shines from the same place as {}: one lamp under two names?", lamp.lamp,
                               lamp.partner);
        case LampFinding::dim:
            return fmt::format("{} is dim: {:.0f} % of what it was beside the other lamps", lamp.lamp,
                               100 * lamp.intensity_ratio.value_or(0));
        case LampFinding::dead:
            if (lamp.intensity_ratio)
                return fmt::format("{} is dead: {:.1f} % of its light is left", lamp.lamp, 100 * *lamp.intensity_ratio);
            return fmt::format("{} was read before and shows no highlight now: it is dead, or its frame was left out",
                               lamp.lamp);
        case LampFinding::unread:
            return fmt::format("{} was not read before, so nothing is known of its movement", lamp.lamp);
        case LampFinding::steady:
            break;
    }
    return {};
}

/// The second name of a pair that its first named already.
bool told_already(const LampDrift& lamp, const std::vector<LampDrift>& lamps) {
    if (lamp.partner.empty() || !mutual(lamp, lamps)) return false;
    const auto place = [&](const std::string& name) {
        return std::find_if(lamps.begin(), lamps.end(), [&](const LampDrift& l) { return l.lamp == name; });
    };
    return place(lamp.partner) < place(lamp.lamp);
}

}  // namespace

const char* name(LampFinding finding) {
    switch (finding) {
        case LampFinding::steady:
            return "steady";
        case LampFinding::moved:
            return "moved";
        case LampFinding::swapped:
            return "swapped";
        case LampFinding::duplicate:
            return "duplicate";
        case LampFinding::dim:
            return "dim";
        case LampFinding::dead:
            return "dead";
        case LampFinding::unread:
            return "unread";
    }
    return "";
}

std::vector<std::string> words_of(const Drift& drift) {
    std::vector<std::string> words;
    if (drift.knock) words.push_back(in_words(*drift.knock, drift.lamps.size()));
    for (const LampFinding finding : gravest_first)
        for (const LampDrift& lamp : drift.lamps)
            if (lamp.finding == finding && !told_already(lamp, drift.lamps))
                words.push_back(in_words(lamp, drift.lamps));
    for (const std::string& lamp : drift.only_before)
        words.push_back(fmt::format("{} is missing from the second calibration", lamp));
    for (const std::string& lamp : drift.only_after)
        words.push_back(fmt::format("{} is new in the second calibration", lamp));
    return words;
}

}  // namespace darkbox
