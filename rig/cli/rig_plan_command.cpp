#include <fmt/format.h>

#include <memory>

#include "acquisition/frame/error.h"
#include "processing/calibration/rig_plan.h"
#include "processing/formats/atomic_file.h"
#include "rig/cli/choices.h"
#include "rig/cli/rig_commands.h"

namespace darkbox {
namespace {

namespace fs = std::filesystem;

struct PlanArguments {
    RigPlanOptions options;
    fs::path toml;
};

Json to_json(const LightGeometry& geometry) {
    return {{"condition_number", geometry.condition_number},
            {"normal_error_deg_per_percent_noise",
             geometry.noise_error_deg ? Json(*geometry.noise_error_deg) : Json(nullptr)},
            {"undetermined_share", geometry.undetermined_share}};
}

std::string lamp_name(std::size_t lamp) { return fmt::format("lamp-{:02}", lamp + 1); }

Json to_json(const RigPlan& plan) {
    Json lamps = Json::array();
    for (std::size_t i = 0; i < plan.positions_mm.size(); ++i) {
        const Eigen::Vector3d& p = plan.positions_mm[i];
        lamps.push_back({{"name", lamp_name(i)}, {"channel", i}, {"position_mm", {p.x(), p.y(), p.z()}}});
    }
    return {{"lamps", lamps},
            {"shadows", plan.shadows == PlanShadows::respected ? "respected" : "ignored"},
            {"predicted_error_deg", plan.predicted_error_deg},
            {"ring_error_deg", plan.ring_error_deg},
            {"plan", to_json(plan.geometry)},
            {"ring", to_json(plan.ring_geometry)}};
}

std::string summary(const RigPlan& plan) {
    return fmt::format(
        "predicted error of normals per 1 % of noise, mean over the visible hemisphere, shadows {}: {:.3f} degrees "
        "(one ring: {:.3f})\nthis plan: {}\none ring:  {}",
        plan.shadows == PlanShadows::respected ? "respected" : "ignored", plan.predicted_error_deg, plan.ring_error_deg,
        in_words(plan.geometry), in_words(plan.ring_geometry));
}

std::string in_text(const RigPlan& plan) {
    std::string text = fmt::format("{:<8} {:>10} {:>10} {:>10} {:>10} {:>10}\n", "lamp", "x mm", "y mm", "z mm",
                                   "elevation", "azimuth");
    constexpr double degrees = 57.29577951308232;
    for (std::size_t i = 0; i < plan.positions_mm.size(); ++i) {
        const Eigen::Vector3d& p = plan.positions_mm[i];
        text += fmt::format("{:<8} {:>10.1f} {:>10.1f} {:>10.1f} {:>9.1f}° {:>9.1f}°\n", lamp_name(i), p.x(), p.y(),
                            p.z(), std::asin(p.z() / p.norm()) * degrees, std::atan2(p.y(), p.x()) * degrees);
    }
    return text + summary(plan);
}

}  // namespace

std::string lamps_toml(const std::vector<Eigen::Vector3d>& positions_mm) {
    std::string toml;
    for (std::size_t i = 0; i < positions_mm.size(); ++i)
        toml += fmt::format("{}[[lamps.lamp]]\nname = \"{}\"\nchannel = {}\nposition_mm = [{:.1f}, {:.1f}, {:.1f}]\n",
                            i == 0 ? "" : "\n", lamp_name(i), i, positions_mm[i].x(), positions_mm[i].y(),
                            positions_mm[i].z());
    return toml;
}

void add_rig_plan_command(CommandLine& line, CLI::App& rig) {
    const auto a = std::make_shared<PlanArguments>();
    CLI::App& command = line.add(
        "plan", "Propose lamp positions that make normals as exact as they can be",
        "darkbox rig plan --lamps 12 --min-elevation 25 --toml lamps.toml",
        [a](const WorkContext& work) {
            const RigPlan plan = plan_rig(a->options, work);
            if (!a->toml.empty()) write_file(a->toml, lamps_toml(plan.positions_mm));
            return CommandResult{to_json(plan), in_text(plan), {}};
        },
        &rig);
    RigPlanOptions& options = a->options;
    command.add_option("--lamps", options.lamps, "How many, 3 to 64")->required();
    command.add_option("--distance-mm", options.distance_mm, "Of every lamp from the object")->capture_default_str();
    command.add_option("--min-elevation", options.min_elevation_deg, "Degrees above the object's plane")
        ->capture_default_str();
    command.add_option("--max-elevation", options.max_elevation_deg, "Degrees; the camera is at 90")
        ->capture_default_str();
    command.add_option("--min-separation", options.min_separation_deg,
                       "Degrees between lamps; default: half of what even spacing would give");
    const std::map<std::string, PlanShadows> shadows{{"automatic", PlanShadows::automatic},
                                                     {"respected", PlanShadows::respected},
                                                     {"ignored", PlanShadows::ignored}};
    command
        .add_option("--shadows", options.shadows,
                    "respected: a lamp below a normal's horizon says nothing of it; ignored: for shallow reliefs; "
                    "automatic: ignored for 3 lamps, respected for more")
        ->transform(one_of(shadows));
    command.add_option("--toml", a->toml, "Also write [[lamps.lamp]] sections for a rig.toml to this file");
}

}  // namespace darkbox
