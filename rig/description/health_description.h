#pragma once

#include <optional>

#include "acquisition/frame/units.h"

namespace darkbox {

/// What is done about a camera that is not warm yet.
enum class WarmUpRule {
    none,    ///< nobody looks
    wait,    ///< a capture waits until it is, `warm_up_longest` at most
    warn,    ///< a capture begins, and says so
    refuse,  ///< a capture does not begin
};

/// [health]: what a rig must be like for a capture to begin.
struct HealthDescription {
    WarmUpRule warm_up = WarmUpRule::none;
    Seconds warm_up_longest{600};
    double steady_level = 0.0005;     ///< share of full scale by which the dark level may change in a minute
    std::optional<double> hottest_c;  ///< of the lamps' heat sink; none: no limit but the lamp controller's own
};

}  // namespace darkbox
