#include "rig/capture/measure_latency.h"

#include <gmock/gmock.h>

#include <fstream>

#include "acquisition/frame/error.h"
#include "rig/capture/timing_store.h"
#include "tests/rig/capture/study/study_rig.h"
#include "tests/rig/capture/study/sync_study.h"
#include "tests/support/test_data.h"

namespace darkbox {
namespace {

using test::Lie;
using test::StudyCase;

/// 30 frames a second, half of each exposed, lamps that come up at once.
StudyCase half_exposed() {
    StudyCase c;
    c.exposure = 0.5 * c.period;
    c.settle = 0;
    c.latency = 2;
    return c;
}

LatencyReport measure(const StudyCase& c) {
    test::StudyClock clock;
    test::StudyLamps lamps(c, clock);
    test::StudyCamera camera(c, clock, lamps);
    const RigDescription rig = test::rig_of(c, SyncMode::settled);
    LatencyReport report = measure_latency(rig, {lamps, camera, clock}, {LampId{3}});
    EXPECT_FALSE(lamps.lit()) << "dark afterwards";
    return report;
}

void expect_timing(const StudyCase& c, double begin_from_stamp, double within) {
    const LatencyReport report = measure(c);
    EXPECT_NEAR(to_seconds(report.timing.begin_from_stamp), begin_from_stamp, within);
    EXPECT_NEAR(to_seconds(report.timing.end_from_stamp), begin_from_stamp + c.exposure + c.readout, within);
    EXPECT_NEAR(to_seconds(report.timing.readout), c.readout, within);
    EXPECT_NEAR(report.exposure.count(), c.exposure, within);
    EXPECT_GE(report.readings, 20u);
}

TEST(MeasureLatency, FindsWhereAnHonestCameraExposes) { expect_timing(half_exposed(), 0, 50e-6); }

TEST(MeasureLatency, FindsTheReadOutOfARollingShutter) {
    StudyCase c = half_exposed();
    c.readout = 0.4 * c.period;
    expect_timing(c, 0, 100e-6);
}

TEST(MeasureLatency, FindsStampsOfTheStartOfReception) {
    StudyCase c = half_exposed();
    c.lie = Lie::reception;
    expect_timing(c, -c.exposure, 50e-6);
}

TEST(MeasureLatency, FindsStampsThatAreOffByMoreThanAFrame) {
    StudyCase c = half_exposed();
    c.lie = Lie::offset;
    c.lie_by = 1.3 * c.period;
    expect_timing(c, -c.lie_by, 50e-6);
}

TEST(MeasureLatency, AveragesJitterAndCountsItsMargin) {
    StudyCase c = half_exposed();
    c.jitter = 0.02 * c.period;
    expect_timing(c, -c.jitter / 2, 0.005 * c.period);
}

TEST(MeasureLatency, GivesALyingCameraPredictiveModeBack) {
    StudyCase c = half_exposed();
    c.lie = Lie::reception;
    const LatencyReport report = measure(c);
    EXPECT_LT(test::study_session(c, SyncMode::predictive).speed.at(0), 0.5);
    const test::StudyTally measured =
        test::study_session(c, SyncMode::predictive, [&](const CameraInfo&) { return report.timing; });
    EXPECT_EQ(measured.lights, c.lamps);
    EXPECT_EQ(measured.wrong + measured.foreign + measured.rejected, 0u);
    EXPECT_GE(measured.speed.at(0), 0.95);
}

TEST(MeasureLatency, RefusesNonsense) { EXPECT_THROW(LatencyOptions({LampId{0}, 2}).validate(), InputError); }

class TimingStore : public testing::Test {
protected:
    test::TemporaryFolder folder;
    std::filesystem::path file = folder.path() / "state" / "timing.json";
};

TEST_F(TimingStore, KeepsATimingForItsCameraModeAndExposureAlone) {
    const LatencyReport report = measure(half_exposed());
    EXPECT_FALSE(stored_timing(file, report.camera)) << "there is none yet";
    store_timing(file, report);
    const auto stored = stored_timing(file, report.camera);
    ASSERT_TRUE(stored);
    EXPECT_EQ(stored->begin_from_stamp, report.timing.begin_from_stamp);
    EXPECT_EQ(stored->end_from_stamp, report.timing.end_from_stamp);
    EXPECT_EQ(stored->readout, report.timing.readout);
    EXPECT_EQ(stored->margin, report.timing.margin);
    for (const int change : {0, 1, 2, 3}) {
        CameraInfo other = report.camera;
        if (change == 0) other.id = "another";
        if (change == 1) other.controls.exposure *= 1.1;
        if (change == 2) other.height += 2;
        if (change == 3) other.driver = "uvcvideo";
        EXPECT_FALSE(stored_timing(file, other)) << change;
    }
}

TEST_F(TimingStore, ADamagedFileIsAnErrorWithARemedy) {
    std::filesystem::create_directories(file.parent_path());
    std::ofstream(file) << "[1, 2";
    EXPECT_THROW(stored_timing(file, CameraInfo()), InputError);
}

}  // namespace
}  // namespace darkbox
