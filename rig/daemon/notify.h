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

}  // namespace darkbox
