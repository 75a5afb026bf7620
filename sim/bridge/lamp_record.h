#pragma once

#include "acquisition/device/clock.h"
#include "rig/description/rig_description.h"
#include "sim/bridge/lamp_view.h"
#include "sim/seen_lamps.h"

namespace darkbox::sim {

/// The lamps of a board outside this process, by the file that tells of them (see SeenLamps). Thread-compatible.
class LampRecord final : public LampView {
public:
    /// `rig.sim.lamps_seen` names the file.
    LampRecord(const RigDescription& rig, const Clock& clock) : lamps_(rig.lamps.size()), seen_(rig), clock_(clock) {}

    std::vector<double> burning() const override {
        std::vector<double> burning(lamps_, 0.0);
        const TimePoint now = clock_.now();
        for (const LampShare& lamp : seen_.burning_during({now, now + Nanoseconds(1)}))
            burning.at(lamp.lamp.value) = lamp.share;
        return burning;
    }

private:
    std::size_t lamps_;
    SeenLamps seen_;
    const Clock& clock_;
};

}  // namespace darkbox::sim
