#include <fmt/format.h>

#include <memory>
#include <optional>

#include "acquisition/frame/error.h"
#include "processing/formats/atomic_file.h"
#include "processing/formats/calibration_file.h"
#include "processing/pipeline/session_files.h"
#include "rig/cli/rig_commands.h"
#include "rig/daemon/catalog.h"
#include "rig/daemon/lamp_ageing.h"

namespace darkbox {
namespace {

namespace fs = std::filesystem;

struct AgeingArguments {
    fs::path folder;
    std::string rig;
    fs::path picture;
    fs::path table;
};

std::vector<DatedLights> history_of(const AgeingArguments& a, const fs::path& folder) {
    Catalog catalog(folder, Catalog::Place::in_memory);
    catalog.refresh();
    std::vector<DatedLights> history;
    std::string rig = a.rig;
    for (const CatalogCalibration& c : catalog.calibrations({.limit = 1'000'000})) {
        const auto day = day_of_date(c.created);
        if (rig.empty()) rig = c.rig;
        if (!day || c.rig != rig) continue;
        StoredCalibration stored = read_calibration(ResultFiles(folder / c.session).calibration);
        history.push_back({*day, {std::move(stored.rig), std::move(stored.calibration.lights), c.intensities_known}});
    }
    return history;
}

CommandResult ageing(const AgeingArguments& a) {
    const fs::path folder = a.folder.empty() ? default_sessions_folder() : a.folder;
    const auto lamps = lamp_ageing(history_of(a, folder));
    if (lamps.empty())
        throw InputError(
            fmt::format("{} holds fewer than three calibrations that know the lamps' intensities", folder.string()),
            "calibrate with a grey card or flat frames in view: darkbox calibrate --help");
    CommandResult result;
    result.json["lamps"] = Json::array();
    result.text = fmt::format("{:<20} {:>8} {:>12} {:>8} {:>8}", "lamp", "readings", "% a month", "sigma", "left");
    for (const LampAgeing& l : lamps) {
        result.json["lamps"].push_back({{"lamp", l.lamp},
                                        {"readings", l.readings.size()},
                                        {"percent_per_month", l.percent_per_month},
                                        {"sigma", l.sigma},
                                        {"left", l.left}});
        result.text += fmt::format("\n{:<20} {:>8} {:>12.3f} {:>8.3f} {:>7.1f}%", l.lamp, l.readings.size(),
                                   l.percent_per_month, l.sigma, l.left * 100);
    }
    if (!a.picture.empty()) write_file(a.picture, ageing_picture(lamps));
    if (!a.table.empty()) write_file(a.table, ageing_table(lamps));
    return result;
}

}  // namespace

void add_ageing_command(CommandLine& line) {
    const auto a = std::make_shared<AgeingArguments>();
    CLI::App& command = line.add("ageing", "How the lamps of a rig lose light over months, from its calibrations",
                                 "darkbox ageing --picture ageing.svg --table ageing.csv",
                                 [a](const WorkContext&) { return ageing(*a); });
    command.add_option("--folder", a->folder, "Where the sessions lie; default: $DARKBOX_SESSIONS, or ./sessions");
    command.add_option("--rig", a->rig, "The rig's name; default: that of the first calibration");
    command.add_option("--picture", a->picture, "Curves of the lamps that changed most, SVG");
    command.add_option("--table", a->table, "All lamps, comma-separated");
}

}  // namespace darkbox
