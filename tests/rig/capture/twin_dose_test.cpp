#include <fmt/format.h>
#include <gtest/gtest.h>

#include "rig/capture/capture_session.h"
#include "rig/capture/dose_book.h"
#include "rig/capture/dosed_lamps.h"
#include "rig/capture/light_dose.h"
#include "rig/capture/meter.h"
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

/// What a capture's budget is held against includes the light that found its exposure.
TEST(TwinDose, OfMeteringIsPartOfTheCapture) {
    RigDescription rig = parse_rig(simulated_rig_toml(6), "twin");
    rig.sim.width = 96;
    rig.sim.height = 72;
    rig.capture.metered = true;
    for (LampDescription& lamp : rig.lamps) lamp.dose_per_s = {1000, 0, 0};
    const auto spent_by = [&](const RigDescription& described, const std::filesystem::path& folder) {
        sim::SimRig sim = sim::SimRig::make(described);
        const Session session =
            capture_session({folder / "s", "cup", {}}, described, sim.lamps(), sim.camera(), sim.clock()).session;
        EXPECT_EQ(session.events().back().what,
                  fmt::format("light dose: {:.4g} lux s, 0 J/m2 of ultraviolet, 0 J/m2 of infrared",
                              DoseBook(folder).spent("cup").lux_s));
        return DoseBook(folder).spent("cup").lux_s;
    };
    const test::TemporaryFolder unbound, metered, bound;
    const double whole = spent_by(rig, unbound.path());
    {
        sim::SimRig sim = sim::SimRig::make(rig);
        DoseBook book(metered.path());
        DosedLamps lamps(sim.lamps(), sim.clock(), rig, book, "cup", "s");
        meter_exposure(rig, lamps_named(rig, {}), {lamps, sim.camera(), sim.clock()});
        lamps.finish();
    }
    const double metering = DoseBook(metered.path()).spent("cup").lux_s;
    EXPECT_GT(metering, 0.1 * whole);
    EXPECT_LT(metering, 0.9 * whole);
    rig.dose.capture_lux_s = whole - 0.5 * metering;  // enough for either of the two
    EXPECT_GT(*rig.dose.capture_lux_s, whole - metering);
    EXPECT_THROW(spent_by(rig, bound.path()), DoseExceeded);
    const double one_lamp = (whole - metering) / 6;  // burns longer than it is refused for: the camera is slower
    EXPECT_LE(DoseBook(bound.path()).spent("cup").lux_s, *rig.dose.capture_lux_s + 1.5 * one_lamp);
    EXPECT_LT(DoseBook(bound.path()).spent("cup").lux_s, whole - 0.1 * metering);
}

}  // namespace
}  // namespace darkbox
