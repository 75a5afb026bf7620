#include "rig/daemon/catalog_drift.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <nlohmann/json.hpp>
#include <vector>

#include "acquisition/frame/error.h"
#include "processing/calibration/drift.h"
#include "processing/formats/calibration_file.h"
#include "processing/pipeline/ball_focus.h"
#include "processing/pipeline/session_files.h"

namespace darkbox {
namespace {

namespace fs = std::filesystem;

RigLights stored_lights(const fs::path& session) {
    StoredCalibration stored = read_calibration(ResultFiles(session).calibration);
    return {std::move(stored.rig), std::move(stored.calibration.lights),
            stored.calibration.intensity_origin != IntensityOrigin::unknown};
}

/// The focus ring turns, the lens holder gives, or the ball is not where it was.
std::string softer(const fs::path& before, const fs::path& after, const DriftAlarm& alarm) {
    const auto was = stored_blur_px(before), is = stored_blur_px(after);
    if (!was || !is || *is < alarm.blur_ratio * *was || *is < *was + alarm.blur_px) return "";
    return fmt::format(
        "the picture is less sharp: edges at the ball are {:.2f} px wide, {:.2f} before (alarm above {:.0f} %)", *is,
        *was, alarm.blur_ratio * 100);
}

std::string alarm_of(const LampDrift& lamp, const DriftAlarm& alarm) {
    switch (lamp.finding) {
        case LampFinding::dead:
            return fmt::format("{} is dead", lamp.lamp);
        case LampFinding::swapped:
        case LampFinding::duplicate:
            return fmt::format("{} is {} with {}", lamp.lamp, name(lamp.finding), lamp.partner);
        case LampFinding::moved:
            if (lamp.moved_deg > alarm.moved_deg)
                return fmt::format("{} moved by {:.2f}° (alarm above {:.2f}°)", lamp.lamp, lamp.moved_deg,
                                   alarm.moved_deg);
            break;
        case LampFinding::steady:
        case LampFinding::dim:
        case LampFinding::unread:
            break;
    }
    if (lamp.intensity_ratio && *lamp.intensity_ratio < alarm.dim_ratio)
        return fmt::format("{} gives {:.0f} % of its light before (alarm below {:.0f} %)", lamp.lamp,
                           *lamp.intensity_ratio * 100, alarm.dim_ratio * 100);
    return "";
}

std::string alarms_of(const Drift& drift, const DriftAlarm& alarm) {
    std::vector<std::string> alarms;
    if (drift.knock && drift.knock->angle_deg > alarm.knocked_deg)
        alarms.push_back(fmt::format("the camera turned by {:.2f}° (alarm above {:.2f}°)", drift.knock->angle_deg,
                                     alarm.knocked_deg));
    for (const LampDrift& lamp : drift.lamps)
        if (std::string told = alarm_of(lamp, alarm); !told.empty()) alarms.push_back(std::move(told));
    for (const std::string& lamp : drift.only_before) alarms.push_back(fmt::format("{} is missing", lamp));
    return fmt::format("{}", fmt::join(alarms, "; "));
}

}  // namespace

CatalogDrift compare_calibrations(const fs::path& folder, const std::string& before, const std::string& after,
                                  const std::string& role, const DriftAlarm& alarm) {
    CatalogDrift result{.session = after, .against = before, .role = role};
    try {
        const Drift drift = drift_between(stored_lights(folder / before), stored_lights(folder / after));
        const std::string blurred = softer(folder / before, folder / after, alarm);
        result.steady = drift.steady() && blurred.empty();
        result.alarm = alarms_of(drift, alarm);
        nlohmann::json findings(drift.findings);
        if (!blurred.empty()) {
            result.alarm += (result.alarm.empty() ? "" : "; ") + blurred;
            findings.push_back(blurred);
        }
        result.findings_json = findings.dump();
    } catch (const Error& error) {
        result.steady = false;
        result.alarm = fmt::format("cannot be compared with {}: {}", before, error.what());
        result.findings_json = "[]";
    }
    return result;
}

}  // namespace darkbox
