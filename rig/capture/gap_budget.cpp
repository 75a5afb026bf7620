#include "rig/capture/gap_budget.h"

#include <fmt/format.h>

#include <algorithm>

namespace darkbox {

std::string GapBudget::words() const {
    return fmt::format(
        "of {:.2f} ms between frames exposure and read-out take {:.2f}, the lamps' settling {:.2f}, a "
        "switch {:.2f} and jitter {:.2f} on either side",
        to_milliseconds(period), to_milliseconds(exposed), to_milliseconds(settle), to_milliseconds(switching),
        to_milliseconds(margin));
}

GapBudget gap_budget(const ExposureClock& rhythm, const RigDescription& rig, std::span<const Shot> shots) {
    GapBudget budget;
    budget.period = rhythm.period();
    const Interval exposed = rhythm.predicted(0);
    budget.exposed = exposed.end - exposed.begin;
    for (const Shot& shot : shots)
        budget.settle = std::max(budget.settle, to_nanoseconds(rig.lamps.at(shot.lamp->value).settle));
    return budget;
}

}  // namespace darkbox
