#pragma once

#include <filesystem>
#include <memory>

#include "rig/description/rig_description.h"
#include "sim/faults.h"
#include "sim/lamp_pictures.h"
#include "sim/scene.h"
#include "sim/seen_lamps.h"
#include "sim/sim_camera.h"
#include "sim/sim_clock.h"
#include "sim/sim_door.h"
#include "sim/sim_lamps.h"

namespace darkbox::sim {

/// The sensor of a description.
Sensor sensor_of(const SimDescription& sim);

/// The whole simulated rig: what a command or the daemon uses in place of devices. Move-only; the parts refer to each
/// other and stay where they are. Thread-compatible; the clock is thread-safe.
class SimRig {
public:
    /// The scene, sensor, lamps and faults of the description. Throws InputError for an unknown scene or fault, or a
    /// value out of range.
    /// The scene is rendered when the camera is started for the first time.
    static SimRig make(const RigDescription& rig, const FaultPlan& more_faults = {});
    /// A new one of the same description, dark and cold, with no frame delivered, that has this one's rendered scene.
    static SimRig make_again(const SimRig& other);

    SimRig(SimRig&&) noexcept = default;
    SimRig& operator=(SimRig&& other) noexcept;
    ~SimRig() = default;

    SimClock& clock() { return *clock_; }
    /// Where sim.lamps_seen names a file, the camera does not see these.
    SimLamps& lamps() { return *lamps_; }
    SimCamera& camera() { return *camera_; }
    SimDoor& door() { return *door_; }
    const Scene& scene() const { return *scene_; }

    /// Ground truth of the scene and of every frame delivered so far; see sim/truth.h for the files.
    void write_truth(const std::filesystem::path& folder) const;

private:
    SimRig() = default;

    std::shared_ptr<const RigDescription> description_;
    FaultPlan faults_;
    std::shared_ptr<const Scene> scene_;
    std::shared_ptr<LampPictures> pictures_;
    std::unique_ptr<SimClock> clock_;
    std::unique_ptr<SimLamps> lamps_;
    std::unique_ptr<SeenLamps> seen_;  ///< what the camera sees instead
    std::unique_ptr<SimCamera> camera_;
    std::unique_ptr<SimDoor> door_;
};

}  // namespace darkbox::sim
