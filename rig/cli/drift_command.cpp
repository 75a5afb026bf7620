#include <fmt/format.h>

#include <memory>

#include "processing/calibration/drift.h"
#include "processing/formats/calibration_file.h"
#include "processing/pipeline/session_files.h"
#include "rig/cli/commands.h"

namespace darkbox {
namespace {

namespace fs = std::filesystem;

struct DriftArguments {
    fs::path before;
    fs::path after;
    DriftOptions options;
};

/// A lights.json, or a session that has one.
RigLights read_rig_lights(const fs::path& from) {
    StoredCalibration stored = read_calibration(fs::is_directory(from) ? ResultFiles(from).calibration : from);
    return {std::move(stored.rig), std::move(stored.calibration.lights),
            stored.calibration.intensity_origin != IntensityOrigin::unknown};
}

Json to_json(const LampDrift& lamp) {
    Json json{{"lamp", lamp.lamp},       {"finding", name(lamp.finding)}, {"moved_deg", lamp.moved_deg},
              {"raw_deg", lamp.raw_deg}, {"sigma_deg", lamp.sigma_deg},   {"sigma_assumed", lamp.sigma_assumed},
              {"p_value", lamp.p_value}};
    if (!lamp.partner.empty()) json["partner"] = lamp.partner;
    if (lamp.farther_mm) json["farther_mm"] = *lamp.farther_mm;
    if (lamp.farther_mm) json["farther_sigma_mm"] = lamp.farther_sigma_mm;
    if (lamp.intensity_ratio) json["intensity_ratio"] = *lamp.intensity_ratio;
    return json;
}

Json to_json(const Drift& drift) {
    Json lamps = Json::array();
    for (const LampDrift& lamp : drift.lamps) lamps.push_back(to_json(lamp));
    Json json{{"steady", drift.steady()},
              {"lamps", lamps},
              {"only_before", drift.only_before},
              {"only_after", drift.only_after}};
    if (drift.knock)
        json["camera_knocked"] = {{"angle_deg", drift.knock->angle_deg},
                                  {"axis", {drift.knock->axis.x(), drift.knock->axis.y(), drift.knock->axis.z()}},
                                  {"lamps", drift.knock->lamps},
                                  {"p_value", drift.knock->p_value}};
    return json;
}

std::string in_text(const Drift& drift) {
    std::string text = fmt::format("{:<20} {:>9} {:>9} {:>9} {:>9}  {}\n", "lamp", "stored °", "moved °", "sigma °",
                                   "chance", "finding");
    bool assumed = false;
    for (const LampDrift& lamp : drift.lamps) {
        text += fmt::format("{:<20} {:>8.3f} {:>8.3f} {:>8.3f}{} {:>9.2g}  {}{}\n", lamp.lamp, lamp.raw_deg,
                            lamp.moved_deg, lamp.sigma_deg, lamp.sigma_assumed ? '*' : ' ', lamp.p_value,
                            name(lamp.finding), lamp.partner.empty() ? "" : " with " + lamp.partner);
        assumed = assumed || lamp.sigma_assumed;
    }
    if (assumed) text += "* not known to a calibration, so taken as given by --unknown-sigma\n";
    return text + (drift.steady() ? "nothing moved" : fmt::format("{} findings", drift.findings.size()));
}

}  // namespace

void add_drift_command(CommandLine& line) {
    const auto a = std::make_shared<DriftArguments>();
    CLI::App& command = line.add("drift", "What moved between two calibrations of one rig",
                                 "darkbox drift sessions/march sessions/may", [a](const WorkContext&) {
                                     const Drift drift = drift_between(read_rig_lights(a->before),
                                                                       read_rig_lights(a->after), a->options);
                                     return CommandResult{to_json(drift), in_text(drift), drift.findings};
                                 });
    command.add_option("before", a->before, "A lights.json, or a session that has one")->required();
    command.add_option("after", a->after, "The same, of a later day")->required();
    command
        .add_option("--false-alarm", a->options.false_alarm,
                    "Chance that any lamp is called moved when all stand still")
        ->capture_default_str();
    command
        .add_option("--unknown-sigma", a->options.unknown_sigma_deg,
                    "Degrees, where a calibration does not know its own uncertainty")
        ->capture_default_str();
    command.add_flag_callback(
        "--any-rig", [a] { a->options.other_rig = OtherRig::compare; },
        "Compare calibrations of different rigs; lamps without a common name by their place");
}

}  // namespace darkbox
