#include <gmock/gmock.h>

#include "tests/rig/capture/twin.h"

namespace darkbox {
namespace {

/// As `./run load capture` has it, but small and in virtual time.
struct MosaicTwin : test::Twin {
    explicit MosaicTwin(SyncMode mode) {
        rig.sim.colour = "rggb";
        rig.sim.bit_depth = 16;
        rig.sim.quick_noise = true;
        rig.capture.mode = mode;
    }
};

void expect_lit_by_its_lamp(const sim::SimCamera& camera, const FrameRecord& record) {
    EXPECT_TRUE(record.verified) << record.file;
    EXPECT_EQ(record.format, "rggb16");
    for (const sim::ExposureTruth& truth : camera.exposures()) {
        if (truth.timestamp.time_since_epoch().count() != record.timestamp_ns) continue;
        ASSERT_EQ(truth.lamps.size(), record.lamp ? 1U : 0U) << record.file;
        if (!record.lamp) return;
        EXPECT_EQ(truth.lamps[0].lamp, *record.lamp) << record.file;
        EXPECT_NEAR(truth.lamps[0].share, 1.0, 1e-6) << record.file;
        return;
    }
    ADD_FAILURE() << record.file << " was never exposed";
}

class QuickTwin : public testing::TestWithParam<SyncMode> {};

TEST_P(QuickTwin, ASessionIsVerifiedAndMatchesTheTruth) {
    MosaicTwin twin(GetParam());
    twin.rig.capture.averages = 3;
    const CapturedSession captured =
        twin.capture({.folder = twin.folder.path() / "session", .object = "a twin", .lamps = {}});
    EXPECT_EQ(captured.summary.repeated, 0);
    captured.session.verify();
    ASSERT_EQ(captured.session.frames().size(), 2U + 3 * 6);
    for (const FrameRecord& record : captured.session.frames()) expect_lit_by_its_lamp(twin.sim().camera(), record);
}

SensorNoise noise_found(SyncMode mode, bool quick) {
    MosaicTwin twin(mode);
    twin.rig.sim.quick_noise = quick;
    return twin.capture().frames().back().noise.value();
}

/// The capture measures the noise by itself: that of the sensor as it is described, and as exact noise gives it.
TEST_P(QuickTwin, TheNoiseFoundIsThatOfExactFrames) {
    const SensorNoise quick = noise_found(GetParam(), true);
    const SensorNoise exact = noise_found(GetParam(), false);
    const double per_electron = (65535 - 1024) / SimDescription().full_well_e;
    EXPECT_NEAR(quick.slope / per_electron, 1.0, 0.05);
    EXPECT_NEAR(quick.slope / exact.slope, 1.0, 0.03);
}

INSTANTIATE_TEST_SUITE_P(Modes, QuickTwin, testing::Values(SyncMode::settled, SyncMode::predictive, SyncMode::strobed),
                         [](const auto& mode) { return std::string(name(mode.param)); });

}  // namespace
}  // namespace darkbox
