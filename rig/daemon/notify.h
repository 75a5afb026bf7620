#pragma once

#include <chrono>
#include <optional>

namespace darkbox {

/// What systemd is told; nothing happens where systemd did not start this process.
void notify_ready();
void notify_stopping();
void notify_alive();

/// How often systemd wants notify_alive(): twice as often as its watchdog's deadline. No value: it has none.
std::optional<std::chrono::microseconds> watchdog_period();

/// Listening sockets that systemd opened for this process (darkboxd.socket).
struct InheritedSockets {
    std::optional<int> local;  ///< a Unix socket
    std::optional<int> tcp;
};
/// Empty where there are none. The descriptors are close-on-exec, and children do not hear of them. Throws InputError
/// for a socket that is neither, or one too many of a kind.
InheritedSockets inherited_sockets();

}  // namespace darkbox
