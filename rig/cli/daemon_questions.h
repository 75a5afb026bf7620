#pragma once

#include <filesystem>
#include <string>

#include "rig/cli/command_line.h"
#include "rig/daemon/client.h"

namespace darkbox {

/// The darkboxd at `socket`; an empty path means where it is expected. Throws InputError when it is expected nowhere.
inline DaemonClient client_at(const std::filesystem::path& socket) {
    return DaemonClient(socket.empty() ? default_socket() : socket);
}

/// The daemon's answer, in the order in which Json prints.
inline Json ask(const DaemonClient& client, const std::string& method, const std::string& target) {
    return Json::parse(client.call(method, target).dump());
}

}  // namespace darkbox
