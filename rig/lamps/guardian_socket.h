#pragma once

#include <sys/types.h>

#include <filesystem>
#include <optional>

#include "acquisition/device/unique_fd.h"
#include "acquisition/frame/units.h"

namespace darkbox {

/// The talk with a guardian that runs by itself (darkbox-guardian), which has greeted and hears no other daemon now.
struct GuardianConnection {
    UniqueFd channel;
    pid_t process = -1;
};

/// Where such a guardian listens: $DARKBOX_GUARDIAN, else /run/darkbox/guardian.sock.
std::filesystem::path guardian_socket();

/// No value where nobody listens there, or not for this user. Throws DeviceError where somebody does and refuses, is of
/// another version, or says nothing for `greeting_within`.
std::optional<GuardianConnection> connect_guardian(const std::filesystem::path& socket,
                                                   Nanoseconds greeting_within = std::chrono::seconds(5));

/// Whether the other end says something, or hangs up, in this time.
bool await_packet(const UniqueFd& channel, Nanoseconds within);

}  // namespace darkbox
