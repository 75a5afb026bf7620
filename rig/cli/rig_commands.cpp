#include "rig/cli/rig_commands.h"

#include <fmt/format.h>

#include <algorithm>
#include <memory>

#include "rig/capture/capture_run.h"
#include "rig/capture/dosed_lamps.h"
#include "rig/capture/light_dose.h"
#include "rig/cli/daemon_questions.h"
#include "rig/daemon/hardware.h"
#include "rig/daemon/session_folder.h"
#include "rig/health/rig_check.h"

namespace darkbox {
namespace {

namespace fs = std::filesystem;

struct RigArguments {
    fs::path rig;
    fs::path socket;
    bool camera = false;
    bool measure = false;
    std::string object;
    fs::path sessions;
};

/// The objects that have had most light, and all of them for --json.
void tell_doses(const Json& answer, CommandResult& result) {
    constexpr std::size_t shown = 10;
    result.json["dose"] = answer;
    std::vector<Json> objects = answer.at("objects");
    std::stable_sort(objects.begin(), objects.end(), [](const Json& a, const Json& b) {
        return a.at("lux_s").get<double>() > b.at("lux_s").get<double>();
    });
    const Json& limits = answer.at("limits");
    const std::string budget =
        limits.contains("object_lux_s") ? fmt::format(" of {:.4g}", limits.at("object_lux_s").get<double>()) : "";
    for (std::size_t i = 0; i < std::min(shown, objects.size()); ++i)
        result.text +=
            fmt::format("\nlight on {}: {:.4g}{} lux s, {:.4g} J/m2 UV, {:.4g} J/m2 IR",
                        objects[i].at("object").get<std::string>(), objects[i].at("lux_s").get<double>(), budget,
                        objects[i].at("uv_j_per_m2").get<double>(), objects[i].at("ir_j_per_m2").get<double>());
}

CommandResult rig_status(const RigArguments& a, const WorkContext&) {
    CommandResult result;
    result.json = ask(client_at(a.socket), "GET", "status");
    result.text =
        fmt::format("{}: {}, {} lamps, darkboxd {}", result.json.at("rig").get<std::string>(),
                    result.json.at("state").get<std::string>(), result.json.at("lamps").at("count").get<int>(),
                    result.json.at("version").get<std::string>());
    const Json& lamps = result.json.at("lamps");
    if (lamps.contains("temperature_c"))
        result.text += fmt::format("\nlamps: {:.0f} degrees Celsius", lamps.at("temperature_c").get<double>());
    for (const Json& problem : lamps.at("problems")) result.warnings.push_back(problem);
    if (result.json.contains("running")) {
        const Json& job = result.json.at("running");
        result.text += fmt::format("\ncapturing {}: {} of {}", job.at("session").get<std::string>(),
                                   job.at("progress").at("done").get<int>(), job.at("progress").at("total").get<int>());
    }
    tell_doses(ask(client_at(a.socket), "GET", "dose"), result);
    if (result.json.contains("problem")) result.warnings.push_back(result.json.at("problem"));
    return result;
}

void tell_camera(const CameraInfo& camera, CommandResult& result) {
    result.json["camera_in_effect"] = {{"model", camera.model},
                                       {"id", camera.id},
                                       {"width", camera.width},
                                       {"height", camera.height},
                                       {"format", name(camera.format)},
                                       {"bit_depth", camera.bit_depth},
                                       {"frame_rate", 1.0 / camera.frame_period.count()},
                                       {"exposure_ms", camera.controls.exposure.count() * 1000},
                                       {"gain", camera.controls.gain},
                                       {"notes", camera.notes}};
    result.text +=
        fmt::format("\n{} holds: {}x{} {} of {} bits, {:.3g} frames a second, {:.4g} ms at gain {:.4g}", camera.model,
                    camera.width, camera.height, name(camera.format), camera.bit_depth,
                    1.0 / camera.frame_period.count(), camera.controls.exposure.count() * 1000, camera.controls.gain);
    for (const std::string& note : camera.notes) result.text += "\n" + note;
}

Json number_or_null(const std::optional<double>& value) { return value ? Json(*value) : Json(nullptr); }

/// The light of a check is counted as a capture's is.
RigReport measured(const RigArguments& a, const RigDescription& rig, const CaptureDevices& devices,
                   const WorkContext& work) {
    if (!knows_doses(rig)) return check_rig(rig, devices, {}, work);
    DoseBook book(a.sessions.empty() ? default_sessions_folder() : a.sessions);
    DosedLamps lamps(devices.lamps, devices.clock, rig, book, a.object, "rig check");
    RigReport report = check_rig(rig, {lamps, devices.camera, devices.clock}, {}, work);
    lamps.finish();
    return report;
}

void measure_rig(const RigArguments& a, const RigDescription& rig, const WorkContext& work, CommandResult& result) {
    Hardware hardware(rig);
    RigReport report;
    hardware.open()->lend([&](const CaptureDevices& devices) { report = measured(a, rig, devices, work); });
    Json findings = Json::array();
    for (const RigFinding& f : report.findings)
        findings.push_back({{"what", f.what},
                            {"where", f.where},
                            {"value", number_or_null(f.value)},
                            {"limit", number_or_null(f.limit)},
                            {"unit", f.unit},
                            {"verdict", name(f.verdict)},
                            {"words", f.words}});
    result.json["good"] = report.good();
    result.json["findings"] = std::move(findings);
    result.text += "\n" + report.table();
    result.failures = report.failures();
    for (const RigFinding& f : report.findings)
        if (f.verdict == RigVerdict::untold)
            result.warnings.push_back(
                fmt::format("{}{} was not measured: {}", f.what, f.where.empty() ? "" : " of " + f.where, f.words));
}

CommandResult rig_check(const RigArguments& a, const WorkContext& work) {
    const RigDescription rig = load_rig(a.rig);
    const CapturePlan plan = plan_capture(rig);
    CommandResult result;
    result.json = {{"rig", rig.name},
                   {"camera", rig.camera.driver},
                   {"lamps_driver", rig.lamps_driver},
                   {"lamps", rig.lamps.size()},
                   {"shots", plan.shots.size()}};
    result.text = fmt::format("{} is valid: rig {}, {} {} lamps, {} camera, {} shots for all of them", a.rig.string(),
                              rig.name, rig.lamps.size(), rig.lamps_driver, rig.camera.driver, plan.shots.size());
    if (a.camera) tell_camera(check_camera(rig), result);
    if (a.measure) measure_rig(a, rig, work, result);
    return result;
}

using RigRun = CommandResult (*)(const RigArguments&, const WorkContext&);

struct RigCommand {
    CLI::App& command;
    std::shared_ptr<RigArguments> arguments;
};

RigCommand add_rig_command(CommandLine& line, CLI::App* group, const char* name, const char* description,
                           const char* example, RigRun run) {
    const auto a = std::make_shared<RigArguments>();
    return {
        line.add(name, description, example, [a, run](const WorkContext& work) { return run(*a, work); }, group), a};
}

void add_to_daemon(CommandLine& line, CLI::App& group, const char* name, const char* description, const char* example,
                   RigRun run) {
    const auto [command, a] = add_rig_command(line, &group, name, description, example, run);
    command.add_option("--socket", a->socket, "Where darkboxd listens");
}

}  // namespace

void add_rig_commands(CommandLine& line) {
    CLI::App& rig = line.add_group("rig", "The rig as darkboxd sees it, and its description");
    add_to_daemon(line, rig, "status", "What darkboxd is doing", "darkbox rig status", rig_status);
    const auto [check, check_arguments] =
        add_rig_command(line, &rig, "check", "Check a rig.toml, and its camera, lamps and place if asked to",
                        "darkbox rig check --rig rig.toml --measure", rig_check);
    check.add_option("--rig", check_arguments->rig, "The rig's description")->required();
    check.add_flag("--camera", check_arguments->camera, "Set up the camera, too, and tell what is in effect");
    auto* measure =
        check.add_flag("--measure", check_arguments->measure,
                       "Light the lamps and measure linearity, flicker, leaks, dim lamps, focus and clipping; status "
                       "1 when one is beyond its limit");
    check.add_option("--object", check_arguments->object, "What stands in the light: its dose is counted")
        ->needs(measure);
    check
        .add_option("--sessions", check_arguments->sessions,
                    "The folder whose book of doses counts; default: $DARKBOX_SESSIONS, ./sessions")
        ->needs(measure);

    add_measure_latency_command(line, rig);
    add_rig_plan_command(line, rig);

    add_lamps_commands(line);
    add_catalog_commands(line);
}

}  // namespace darkbox
