#pragma once

#include <optional>
#include <string>
#include <vector>

#include "processing/calibration/drift.h"

namespace darkbox {

/// One calibration of a rig, and when it was made.
struct DatedLights {
    double day = 0;  ///< since any fixed day
    RigLights calibration;
};

/// How one lamp's light changes, relative to the median lamp of the same calibration: what all lamps share cannot be
/// told from the camera's gain.
struct LampAgeing {
    struct Reading {
        double day = 0;
        double relative = 1;  ///< of the lamp's first reading
    };
    std::string lamp;
    std::vector<Reading> readings;
    double percent_per_month = 0;  ///< of its light at first; the median of all slopes (Theil and Sen)
    double sigma = 0;              ///< of percent_per_month, from the readings' scatter about the line
    double left = 1;               ///< of its light at first, by the line, at the last reading
};

/// The same of any series of positive readings, in the order of their days; no value for fewer than three, or
/// all of one day.
std::optional<LampAgeing> trend_of(const std::string& what, std::vector<LampAgeing::Reading> readings);

/// Of "2026-01-31T...": days since 1970; no value for another form.
std::optional<double> day_of_date(const std::string& when);

/// In the order of the first calibration. Calibrations without known intensities say nothing here; lamps with fewer
/// than three readings are left out.
std::vector<LampAgeing> lamp_ageing(const std::vector<DatedLights>& history);

/// Curves of the lamps that changed most, drawn as SVG.
std::string ageing_picture(const std::vector<LampAgeing>& lamps);
/// Comma-separated: lamp, readings, percent per month, sigma, share left.
std::string ageing_table(const std::vector<LampAgeing>& lamps);

}  // namespace darkbox
