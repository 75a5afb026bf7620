#pragma once

#include "acquisition/camera/camera.h"
#include "rig/lamps/door.h"
#include "rig/lamps/lamp_array.h"
#include "rig/lamps/strobed_lamps.h"

namespace darkbox {

/// Lamps that do not light while the door is open. Throws DoorOpen, with the lamps dark. Thread-compatible.
class InterlockedLamps final : public LampArray, public StrobedLamps {
public:
    /// Both must outlive this.
    InterlockedLamps(LampArray& lamps, Door& door) : lamps_(lamps), door_(door) {}

    std::size_t size() const override { return lamps_.size(); }
    void light(LampId lamp, double level) override;
    void dark() override { lamps_.dark(); }
    LampHealth health() override { return lamps_.health(); }
    StrobedLamps* strobed() override { return lamps_.strobed() ? this : nullptr; }
    void arm(const std::vector<StrobeStep>& program, Nanoseconds exposed) override;
    std::vector<StrobeEvent> take_events() override { return lamps_.strobed()->take_events(); }
    /// Darkens the lamps and throws DoorOpen when the door is open, or what keeps it from being told.
    void watch();

private:
    LampArray& lamps_;
    Door& door_;
};

/// A camera that looks at the door with every wait for a frame; waits are short (see FrameSource), so that the lamps
/// are dark within 50 ms. A frame that was exposed while the door opened is thrown away. Thread-compatible.
class InterlockedCamera final : public Camera {
public:
    /// Both must outlive this.
    InterlockedCamera(Camera& camera, InterlockedLamps& lamps) : camera_(camera), lamps_(lamps) {}

    CameraInfo configure(const CameraConfig& config) override { return camera_.configure(config); }
    void start() override { camera_.start(); }
    Frame next_frame(TimePoint deadline) override;
    void stop() override { camera_.stop(); }

private:
    Camera& camera_;
    InterlockedLamps& lamps_;
};

}  // namespace darkbox
