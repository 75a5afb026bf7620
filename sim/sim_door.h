#pragma once

#include "rig/lamps/door.h"
#include "sim/faults.h"
#include "sim/sim_camera.h"

namespace darkbox::sim {

/// The twin's door: open while a frame that the faults name is the latest delivered. Refers to the camera.
/// Thread-compatible.
class SimDoor final : public Door {
public:
    SimDoor(const SimCamera& camera, FaultPlan faults) : camera_(camera), faults_(std::move(faults)) {}
    bool is_open() override {
        const auto& frames = camera_.exposures();
        return !frames.empty() && faults_.hits(FaultKind::door_open, frames.back().sequence);
    }

private:
    const SimCamera& camera_;
    FaultPlan faults_;
};

}  // namespace darkbox::sim
