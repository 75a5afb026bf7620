#include "rig/daemon/notify.h"

#include <fmt/format.h>
#include <sys/socket.h>
#include <systemd/sd-daemon.h>

#include <cstdint>

#include "acquisition/frame/error.h"

namespace darkbox {

void notify_ready() { ::sd_notify(0, "READY=1"); }
void notify_stopping() { ::sd_notify(0, "STOPPING=1"); }
void notify_alive() { ::sd_notify(0, "WATCHDOG=1"); }

std::optional<std::chrono::microseconds> watchdog_period() {
    std::uint64_t deadline_us = 0;
    if (::sd_watchdog_enabled(0, &deadline_us) <= 0) return std::nullopt;
    return std::chrono::microseconds(deadline_us / 2);
}

InheritedSockets inherited_sockets() {
    InheritedSockets sockets;
    constexpr int listening = 1;
    const int count = ::sd_listen_fds(/*unset_environment=*/1);
    for (int fd = SD_LISTEN_FDS_START; fd < SD_LISTEN_FDS_START + count; ++fd) {
        const bool local = ::sd_is_socket_unix(fd, SOCK_STREAM, listening, nullptr, 0) > 0;
        const bool tcp = ::sd_is_socket_inet(fd, AF_UNSPEC, SOCK_STREAM, listening, 0) > 0;
        std::optional<int>& place = local ? sockets.local : sockets.tcp;
        if ((!local && !tcp) || place)
            throw InputError(
                fmt::format("socket {} of those that systemd handed over is {}", fd - SD_LISTEN_FDS_START + 1,
                            place ? "one too many of its kind" : "no listening Unix or TCP socket"),
                "let darkboxd.socket have one ListenStream= with a path, and at most one with a port");
        place = fd;
    }
    return sockets;
}

}  // namespace darkbox
