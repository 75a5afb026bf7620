#include "rig/daemon/notify.h"

#include <systemd/sd-daemon.h>

#include <cstdint>

namespace darkbox {

void notify_ready() { ::sd_notify(0, "READY=1"); }
void notify_stopping() { ::sd_notify(0, "STOPPING=1"); }
void notify_alive() { ::sd_notify(0, "WATCHDOG=1"); }

std::optional<std::chrono::microseconds> watchdog_period() {
    std::uint64_t deadline_us = 0;
    if (::sd_watchdog_enabled(0, &deadline_us) <= 0) return std::nullopt;
    return std::chrono::microseconds(deadline_us / 2);
}

}  // namespace darkbox
