// A lens that went out of focus between two recalibrations shows at the ball.
#include <gmock/gmock.h>

#include "processing/pipeline/stages.h"
#include "rig/daemon/catalog_drift.h"
#include "rig/daemon/hardware.h"
#include "rig/daemon/lamp_ageing.h"
#include "tests/support/test_data.h"

namespace darkbox {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

/// The built-in rig's recalibration, with its lens out of focus by so many pixels.
double recalibrated_blur(const fs::path& session, double defocus_px, std::uint64_t seed = 1) {
    RigDescription rig = parse_rig(simulated_rig_toml(12), "twin");
    if (defocus_px > 0) rig.sim.faults = "defocus@0=" + std::to_string(defocus_px);
    rig.sim.seed = seed;
    CaptureRequest request;
    request.folder = session;
    request.object = "recalibration";
    Hardware(rig).open()->capture(request, {});
    return run_calibrate(Session::open(session), {}).blur_px.value_or(0);
}

TEST(FocusCreep, IsSeenAtTheBallAndTold) {
    const test::TemporaryFolder folder;
    const double sharp = recalibrated_blur(folder.path() / "first", 0);
    const double again = recalibrated_blur(folder.path() / "again", 0, 7);
    EXPECT_GT(sharp, 0.3);  // a perfect edge of pixels has about half of one
    EXPECT_LT(sharp, 0.6);
    EXPECT_NEAR(again, sharp, 0.1 * sharp);
    const CatalogDrift steady = compare_calibrations(folder.path(), "first", "again", "last");
    EXPECT_TRUE(steady.steady) << steady.alarm;

    const double soft = recalibrated_blur(folder.path() / "soft", 0.7);
    const double softer = recalibrated_blur(folder.path() / "softer", 1.5);
    EXPECT_NEAR(soft, 0.7, 0.15);
    EXPECT_NEAR(softer, 1.5, 0.3);
    for (const char* session : {"soft", "softer"}) {
        const CatalogDrift drift = compare_calibrations(folder.path(), "first", session, "first");
        EXPECT_THAT(drift.alarm, HasSubstr("less sharp"));
        EXPECT_THAT(drift.findings_json, HasSubstr("less sharp"));
        EXPECT_FALSE(drift.steady);
    }
    // The other way it is no alarm: somebody has focused.
    EXPECT_THAT(compare_calibrations(folder.path(), "softer", "first", "last").alarm,
                testing::Not(HasSubstr("less sharp")));
}

TEST(FocusCreep, HasATrend) {
    std::vector<LampAgeing::Reading> readings;
    for (int month = 0; month < 12; ++month) readings.push_back({month * 365.25 / 12, 1.2 * (1 + 0.02 * month)});
    const auto trend = trend_of("rig", readings);
    ASSERT_TRUE(trend);
    EXPECT_NEAR(trend->percent_per_month, 2.0, 0.01);
    EXPECT_NEAR(trend->left, 1.22, 0.001);
    EXPECT_FALSE(trend_of("rig", {readings.begin(), readings.begin() + 2}));
    EXPECT_FALSE(trend_of("rig", {{5, 1}, {5, 2}, {5, 3}}));
    EXPECT_EQ(day_of_date("1970-01-11T09:00:00Z"), 10);
    EXPECT_FALSE(day_of_date("yesterday"));
}

}  // namespace
}  // namespace darkbox
