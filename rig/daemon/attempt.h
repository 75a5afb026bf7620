#pragma once

#include <functional>
#include <optional>

#include "rig/daemon/job.h"

namespace darkbox {

/// Runs the daemon's work and catches: whatever goes wrong comes back as words.
std::optional<Failure> attempt(const std::function<void()>& work) noexcept;

}  // namespace darkbox
