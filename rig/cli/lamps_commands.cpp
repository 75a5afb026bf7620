#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <memory>
#include <optional>
#include <utility>

#include "acquisition/device/clock.h"
#include "acquisition/device/device_error.h"
#include "rig/capture/interlock.h"
#include "rig/capture/light_by_hand.h"
#include "rig/cli/rig_commands.h"
#include "rig/daemon/client.h"
#include "rig/daemon/hardware.h"
#include "rig/daemon/session_folder.h"
#include "rig/lamps/usb_bus.h"

namespace darkbox {
namespace {

namespace fs = std::filesystem;

struct LampsArguments {
    fs::path rig;
    fs::path socket;
    std::string lamp;
    std::optional<double> seconds;
    std::string object;
    bool boards = false;
};

/// The darkboxd that runs, if one does: the lamps are its own then.
std::optional<DaemonClient> running_daemon(const LampsArguments& a) {
    const auto socket = a.socket.empty() ? known_socket() : std::optional(a.socket);
    if (!socket) return std::nullopt;
    DaemonClient client(*socket);
    return client.answers() ? std::optional(std::move(client)) : std::nullopt;
}

RigDescription rig_of(const LampsArguments& a) {
    if (a.rig.empty())
        throw InputError("no darkboxd answers, and no rig is given",
                         "start it (darkboxd --config rig.toml), or add --rig rig.toml");
    return load_rig(a.rig);
}

Json lamps_of(const RigDescription& rig) {
    Json list = Json::array();
    for (const LampDescription& lamp : rig.lamps)
        list.push_back({{"name", lamp.name}, {"position_mm", lamp.position_mm}});
    return {{"driver", rig.lamps_driver}, {"lamps", list}};
}

/// The USB lamp controllers that are plugged in, whoever uses them.
CommandResult list_boards() {
    CommandResult result;
    result.json = {{"boards", Json::array()}};
    for (const UsbBoardInfo& board : UsbBus().boards()) {
        result.json["boards"].push_back({{"serial", board.serial}, {"place", board.place}, {"problem", board.problem}});
        result.text +=
            fmt::format("{}{:<12} {} {}", result.text.empty() ? "" : "\n", board.serial, board.place, board.problem);
    }
    if (result.text.empty()) result.text = "no USB lamp controller is plugged in";
    return result;
}

CommandResult list(const LampsArguments& a) {
    if (a.boards) return list_boards();
    CommandResult result;
    const auto daemon = a.rig.empty() ? running_daemon(a) : std::nullopt;
    result.json = daemon ? Json::parse(daemon->call("GET", "lamps").dump()) : lamps_of(rig_of(a));
    for (const Json& lamp : result.json.at("lamps")) {
        const auto position = lamp.at("position_mm").get<std::array<double, 3>>();
        result.text += fmt::format("{}{:<20} at {:8.1f} {:8.1f} {:8.1f} mm", result.text.empty() ? "" : "\n",
                                   lamp.at("name").get<std::string>(), position[0], position[1], position[2]);
    }
    return result;
}

CommandResult all_dark(const std::string& detail) {
    CommandResult result;
    result.json = {{"dark", true}};
    result.text = detail;
    return result;
}

/// Waits until the daemon says that the lamps are dark: an accepted request is not yet darkness.
CommandResult darken_through(const DaemonClient& client) {
    const DaemonClient::Json accepted = client.call("POST", "lamps/dark");
    DaemonClient::Json told;
    client.follow_events(accepted.at("event"), {.event = [&](const DaemonClient::Json& event) {
                             if (event.at("event") != "lamps") return DaemonClient::Follow::go_on;
                             told = event;
                             return DaemonClient::Follow::leave;
                         }});
    if (told.is_null())
        throw DeviceError("darkboxd stopped before it told whether the lamps are dark", "look at the lamps");
    if (!told.at("dark")) throw DeviceError(told.at("detail"), "cut the lamps' supply");
    return all_dark(told.at("detail"));
}

CommandResult dark(const LampsArguments& a, const WorkContext&) {
    if (const auto daemon = running_daemon(a)) return darken_through(*daemon);
    Hardware hardware(rig_of(a));
    hardware.open_lamps()->dark();
    return all_dark("all lamps are dark");
}

/// Follows the lamp until it is dark again; Ctrl-C darkens it.
CommandResult light_through(const DaemonClient& client, const LampsArguments& a, const WorkContext& work) {
    DaemonClient::Json order{{"lamp", a.lamp}};
    if (a.seconds) order["seconds"] = *a.seconds;
    if (!a.object.empty()) order["object"] = a.object;
    const DaemonClient::Json accepted = client.call("POST", "lamps/on", order);
    DaemonClient::Json told;
    bool asked = false;
    client.follow_events(accepted.at("event"), {.event =
                                                    [&](const DaemonClient::Json& event) {
                                                        if (event.at("event") != "light")
                                                            return DaemonClient::Follow::go_on;
                                                        told = event;
                                                        return DaemonClient::Follow::leave;
                                                    },
                                                .idle =
                                                    [&] {
                                                        if (!work.cancelled() || std::exchange(asked, true)) return;
                                                        client.call("POST", "lamps/dark");
                                                    }});
    if (told.is_null())
        throw DeviceError("darkboxd stopped before it told whether the lamps are dark", "look at the lamps");
    if (!told.at("lit")) throw DeviceError(told.at("detail"), told.at("hint"));
    return all_dark(fmt::format("'{}' was lit; all lamps are dark", a.lamp));
}

CommandResult on(const LampsArguments& a, const WorkContext& work) {
    const auto daemon = running_daemon(a);
    if (daemon && a.rig.empty()) return light_through(*daemon, a, work);
    if (daemon) throw InputError("darkboxd runs, and has its rig already", "leave out --rig");
    const RigDescription rig = rig_of(a);
    const HandLight light =
        light_by_hand(rig, a.lamp, a.seconds ? std::optional(Seconds(*a.seconds)) : std::nullopt, a.object);
    Hardware hardware(rig);
    const auto lamps = hardware.open_lamps();
    const auto door = hardware.open_door();
    const auto sessions = rig.sessions_folder.empty() ? default_sessions_folder() : rig.sessions_folder;
    SystemClock clock;
    if (door) {
        InterlockedLamps guarded(*lamps, *door);
        shine(light, rig, guarded, clock, sessions, work, [&guarded] { guarded.watch(); });
    } else {
        shine(light, rig, *lamps, clock, sessions, work, [] {});
    }
    return all_dark(fmt::format("'{}' was lit; all lamps are dark", a.lamp));
}

}  // namespace

void add_lamps_commands(CommandLine& line) {
    CLI::App& group = line.add_group("lamps", "The lamps of the rig");
    const auto add = [&](const char* name, const char* description, const char* example, auto body) -> auto {
        const auto a = std::make_shared<LampsArguments>();
        CLI::App& command =
            line.add(name, description, example, [a, body](const WorkContext& work) { return body(*a, work); }, &group);
        command.add_option("--socket", a->socket, "Where darkboxd listens");
        command.add_option("--rig", a->rig, "The rig's description, where no darkboxd runs");
        return std::pair<CLI::App*, std::shared_ptr<LampsArguments>>(&command, a);
    };
    const auto [lister, listed] = add("list", "Names and places of the lamps", "darkbox lamps list",
                                      [](const LampsArguments& a, const WorkContext&) { return list(a); });
    lister->add_flag("--boards", listed->boards, "The USB lamp controllers that are plugged in, instead");
    add_lamps_flash_command(line, group);
    add("dark", "Darken every lamp; a running capture is cancelled", "darkbox lamps dark", dark);
    const auto [command, a] =
        add("on", "Light one lamp for a moment", "darkbox lamps on low-1 --seconds 2 --object vase", on);
    command->add_option("name", a->lamp, "The lamp")->required();
    command->add_option("--object", a->object,
                        "What lies in its light, which counts as light it has had; else it is booked on the rig");
    command->add_option("--seconds", a->seconds, "How long; default and most: nine tenths of the lamp's max_on_s")
        ->check(CLI::PositiveNumber);
}

}  // namespace darkbox
