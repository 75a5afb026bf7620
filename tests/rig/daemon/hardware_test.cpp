#include "rig/daemon/hardware.h"

#include <gtest/gtest.h>

#include "rig/lamps/door.h"

namespace darkbox {
namespace {

/// Whoever borrows the devices lights lamps without waiting for frames, too.
TEST(HardwareTest, LendsALookAtTheDoor) {
    RigDescription rig = parse_rig(simulated_rig_toml(4), "twin");
    rig.sim.width = 96;
    rig.sim.height = 72;
    rig.sim.faults = "door-open@3";
    rig.door.emplace();
    Hardware(rig).open()->lend([&](const LentDevices& d) {
        d.camera.configure({rig.camera.exposure, rig.camera.gain});
        d.camera.start();
        const auto next = [&] { return d.camera.next_frame(d.clock.now() + std::chrono::seconds(1)); };
        while (next().sequence < 2) d.look_at_door();
        d.lamps.light(LampId{0}, 1.0);
        EXPECT_THROW(next(), DoorOpen);
        EXPECT_THROW(d.look_at_door(), DoorOpen);
    });
}

}  // namespace
}  // namespace darkbox
