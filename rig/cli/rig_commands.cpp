#include "rig/cli/rig_commands.h"

#include <fmt/format.h>

#include <memory>

#include "rig/capture/capture_run.h"
#include "rig/daemon/client.h"
#include "rig/daemon/hardware.h"

namespace darkbox {
namespace {

namespace fs = std::filesystem;

struct Arguments {
    fs::path rig;
    fs::path socket;
    bool camera = false;
};

DaemonClient client_for(const Arguments& a) { return DaemonClient(a.socket.empty() ? default_socket() : a.socket); }

/// The daemon's answer, in the order in which Json prints.
Json ask(const DaemonClient& client, const std::string& method, const std::string& target) {
    return Json::parse(client.call(method, target).dump());
}

CommandResult rig_status(const Arguments& a) {
    CommandResult result;
    result.json = ask(client_for(a), "GET", "status");
    result.text =
        fmt::format("{}: {}, {} lamps, darkboxd {}", result.json.at("rig").get<std::string>(),
                    result.json.at("state").get<std::string>(), result.json.at("lamps").at("count").get<int>(),
                    result.json.at("version").get<std::string>());
    if (result.json.contains("running")) {
        const Json& job = result.json.at("running");
        result.text += fmt::format("\ncapturing {}: {} of {}", job.at("session").get<std::string>(),
                                   job.at("progress").at("done").get<int>(), job.at("progress").at("total").get<int>());
    }
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

CommandResult rig_check(const Arguments& a) {
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
    return result;
}

using Run = CommandResult (*)(const Arguments&);

struct Added {
    CLI::App& command;
    std::shared_ptr<Arguments> arguments;
};

Added add(CommandLine& line, CLI::App* group, const char* name, const char* description, const char* example, Run run) {
    const auto a = std::make_shared<Arguments>();
    return {line.add(name, description, example, [a, run](const WorkContext&) { return run(*a); }, group), a};
}

void add_to_daemon(CommandLine& line, CLI::App& group, const char* name, const char* description, const char* example,
                   Run run) {
    const auto [command, a] = add(line, &group, name, description, example, run);
    command.add_option("--socket", a->socket, "Where darkboxd listens");
}

}  // namespace

void add_rig_commands(CommandLine& line) {
    CLI::App& rig = line.add_group("rig", "The rig as darkboxd sees it, and its description");
    add_to_daemon(line, rig, "status", "What darkboxd is doing", "darkbox rig status", rig_status);
    const auto [check, check_arguments] = add(line, &rig, "check", "Check a rig.toml, and its camera if asked to",
                                              "darkbox rig check --rig rig.toml", rig_check);
    check.add_option("--rig", check_arguments->rig, "The rig's description")->required();
    check.add_flag("--camera", check_arguments->camera, "Set up the camera, too, and tell what is in effect");

    add_measure_latency_command(line, rig);
    add_rig_plan_command(line, rig);

    add_lamps_commands(line);
    add_catalog_commands(line);
}

}  // namespace darkbox
