#include <gtest/gtest.h>

#include "rig/capture/capture_session.h"
#include "rig/capture/dose_book.h"
#include "sim/sim_rig.h"
#include "tests/support/test_data.h"

namespace darkbox {
namespace {

/// What the twin's lamps really gave is what the book says, at every speed.
TEST(TwinDose, IsTheLightThatTheLampsGave) {
    for (const SyncMode mode : {SyncMode::settled, SyncMode::predictive, SyncMode::strobed}) {
        RigDescription rig = parse_rig(simulated_rig_toml(6), "twin");
        rig.sim.width = 96;
        rig.sim.height = 72;
        rig.capture.mode = mode;
        for (LampDescription& lamp : rig.lamps) lamp.dose_per_s = {1000, 0, 0};
        const test::TemporaryFolder folder;
        sim::SimRig sim = sim::SimRig::make(rig);
        const TimePoint begin = sim.clock().now();
        (void)capture_session({folder.path() / "s", "cup", {}}, rig, sim.lamps(), sim.camera(), sim.clock());
        double lit_s = 0;
        const Interval all{begin, sim.clock().now() + std::chrono::seconds(1)};
        for (const sim::LampShare& lamp : sim.lamps().burning_during(all))
            lit_s += lamp.share * to_seconds(all.end - all.begin);
        EXPECT_GT(lit_s, 6 * rig.camera.exposure.count()) << name(mode);
        EXPECT_NEAR(DoseBook(folder.path()).spent("cup").lux_s, 1000 * lit_s, 1) << name(mode);
    }
}

}  // namespace
}  // namespace darkbox
