// Metering on the digital twin, whose object is known pixel by pixel.
#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>

#include "acquisition/session/frame_file.h"
#include "rig/capture/capture_session.h"
#include "rig/capture/meter.h"
#include "sim/renderer.h"
#include "sim/sim_rig.h"
#include "tests/rig/capture/twin.h"

namespace darkbox {
namespace {

using test::Twin;
using testing::AllOf;
using testing::HasSubstr;

/// The object's 99.9th percentile under its brightest lamp by the twin's own mask; samples above the black level.
double level_of(const Session& session, const sim::Scene& scene) {
    const sim::SceneTruth truth = sim::render_truth(scene);
    double most = 0;
    for (const FrameRecord& record : session.frames()) {
        if (record.kind != FrameKind::lit) continue;
        const Frame frame = read_frame(session.path_of(record), record);
        std::vector<double> levels;
        for (std::size_t pixel = 0; pixel < truth.mask.size(); ++pixel) {
            if (!truth.mask[pixel]) continue;
            const double sample = test::brightest_sample(frame, pixel);
            levels.push_back((sample - frame.black_level) / (std::exp2(frame.bit_depth) - 1 - frame.black_level));
        }
        std::ranges::sort(levels);
        most = std::max(most, levels[static_cast<std::size_t>(0.999 * static_cast<double>(levels.size() - 1))]);
    }
    return most;
}

TEST(Metering, PutsTheObjectAtEightyToNinetyPercentFromAnywhere) {
    for (const double begin_ms : {0.05, 2.0, 20.0, 90.0}) {
        Twin twin;
        twin.rig.camera.exposure = Seconds(begin_ms / 1000);
        const Session session = twin.capture(ExposureChoice{});
        const double level = level_of(session, twin.sim().scene());
        EXPECT_GE(level, 0.79) << begin_ms;
        EXPECT_LE(level, 0.91) << begin_ms;
        ASSERT_EQ(session.frames().size(), 8U) << "metered frames are not kept";
        ASSERT_FALSE(session.events().empty());
        EXPECT_THAT(session.events().front().what,
                    AllOf(HasSubstr("metered: exposure "), HasSubstr("% of full scale"), HasSubstr("none kept")));
        EXPECT_THAT(session.info().notes, testing::Contains(testing::StartsWith("exposure in us: ")));
        EXPECT_TRUE(twin.sim().lamps().all_dark());
        for (const FrameRecord& record : session.frames())
            EXPECT_EQ(record.exposure_s, session.frames().front().exposure_s);
    }
}

TEST(Metering, IsAskedForByTheRigToo) {
    Twin twin;
    twin.rig.camera.exposure = Seconds(0.004);
    twin.rig.capture.metered = true;
    const double level = level_of(twin.capture(), twin.sim().scene());
    EXPECT_GE(level, 0.79);
    EXPECT_LE(level, 0.91);
}

TEST(Metering, AFixedExposureOverrulesTheRig) {
    Twin twin;
    twin.rig.capture.metered = true;
    const Session session = twin.capture(ExposureChoice{Seconds(0.007)});
    EXPECT_DOUBLE_EQ(session.frames().front().exposure_s, 0.007);
    EXPECT_TRUE(session.events().empty());
}

TEST(Metering, TakesWholePeriodsOfTheFlicker) {
    Twin free;
    const double exact = free.meter().exposure.count();
    for (const double hz : {400.0, 150.0}) {
        Twin twin;
        twin.rig.flicker_hz = hz;
        const Metering found = twin.meter();
        const double periods = found.exposure.count() * hz;
        EXPECT_NEAR(periods, std::round(periods), 1e-6);
        EXPECT_LE(found.level, 0.90);
        EXPECT_GT(found.level * (periods + 1) / periods, 0.85) << "one more would have fitted better";
        EXPECT_NEAR(found.level / found.exposure.count(), 0.85 / exact, 0.06 / exact);
    }
}

TEST(Metering, SaysWhenTheObjectIsTooDark) {
    Twin twin;
    for (LampDescription& lamp : twin.rig.lamps) lamp.max_on = Seconds(0.205);
    twin.rig.camera.exposure = Seconds(0.001);
    twin.rig.camera.gain = 0.05;
    try {
        twin.meter();
        FAIL();
    } catch (const InputError& error) {
        EXPECT_THAT(error.what(), AllOf(HasSubstr("too dark to be metered: under lamp 'lamp-0"),
                                        HasSubstr("at the longest exposure that camera and lamps allow, 50 ms")));
        EXPECT_THAT(error.hint(), HasSubstr("raise gain"));
    }
    EXPECT_TRUE(twin.sim().lamps().all_dark());
}

TEST(Metering, SaysWhenTheObjectIsTooBright) {
    Twin twin;
    twin.rig.camera.gain = 2000;
    try {
        twin.meter();
        FAIL();
    } catch (const InputError& error) {
        EXPECT_THAT(error.what(),
                    AllOf(HasSubstr("too bright to be metered"), HasSubstr("shortest exposure"), HasSubstr("0.02 ms")));
    }
}

TEST(Metering, GetsOverFramesThatComeDamaged) {
    Twin twin("error-flag@1x2 drop@5 hang@9");
    const Metering found = twin.meter();
    EXPECT_GE(found.level, 0.80);
    EXPECT_LE(found.level, 0.90);
}

}  // namespace
}  // namespace darkbox
