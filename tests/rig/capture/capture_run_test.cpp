#include "rig/capture/capture_run.h"

#include <gmock/gmock.h>

#include "acquisition/device/device_error.h"
#include "rig/capture/session_recorder.h"
#include "tests/rig/capture/bench.h"

namespace darkbox {
namespace {

using std::chrono::milliseconds;
using test::Bench;

TEST(CaptureRun, TakesEveryShotOnceAndRight) {
    Bench bench;
    const Session session = bench.capture();
    test::expect_every_frame_right(session, bench.rig);
    EXPECT_TRUE(session.events().empty()) << test::events_of(session);
    EXPECT_TRUE(bench.lamps.is_dark());
    EXPECT_LT(bench.lamps.longest_on(), milliseconds(150));
    EXPECT_EQ(bench.camera.starts, 1);
}

TEST(CaptureRun, RecordsWhatWasInEffect) {
    Bench bench;
    const Session session = bench.capture();
    const FrameRecord& dark = session.frames().front();
    EXPECT_EQ(dark.kind, FrameKind::dark);
    EXPECT_EQ(dark.file, "frames/0000_dark.tif");
    EXPECT_EQ(dark.lamp, std::nullopt);
    const FrameRecord& lit = session.frames()[3];
    EXPECT_EQ(lit.file, "frames/0003_lamp-03.tif");
    EXPECT_EQ(lit.kind, FrameKind::lit);
    EXPECT_EQ(lit.lamp, LampId{2});
    EXPECT_EQ(lit.lamp_name, "lamp-03");
    EXPECT_EQ(lit.exposure_s, 0.02);
    EXPECT_EQ(lit.gain, 1.0);
    EXPECT_EQ(lit.bit_depth, 12);
    EXPECT_EQ(lit.black_level, 64);
    EXPECT_GT(lit.sequence, session.frames()[2].sequence);
    EXPECT_GE(lit.timestamp_ns, lit.lamp_on_ns + 5'000'000) << "the settle time is over";
    EXPECT_GE(lit.lamp_off_ns, lit.timestamp_ns + 20'000'000) << "the exposure is over";
    EXPECT_THAT(lit.verification, testing::HasSubstr("within the steady time"));
    EXPECT_THAT(lit.verification, testing::HasSubstr("differs from lamp 'lamp-02'"));
}

TEST(CaptureRun, TellsItsProgress) {
    Bench bench;
    std::vector<std::string> told;
    WorkContext work;
    work.report = [&](const ProgressUpdate& u) {
        told.push_back(u.stage + " " + std::to_string(u.done) + "/" + std::to_string(u.total) + " " + u.detail);
    };
    capture_session(bench.request(), bench.rig, bench.lamps, bench.camera, bench.clock, work);
    EXPECT_THAT(told,
                testing::ElementsAre("capture 0/6 dark", "capture 1/6 lamp-01", "capture 2/6 lamp-02",
                                     "capture 3/6 lamp-03", "capture 4/6 lamp-04", "capture 5/6 dark", "capture 6/6 "));
}

TEST(CaptureRun, WaitsForASlowLamp) {
    Bench bench;
    bench.rig.lamps[1].settle = Seconds(0.4);
    const Session session = bench.capture();
    test::expect_every_frame_right(session, bench.rig);
    const FrameRecord& slow = session.frames()[2];
    EXPECT_GE(slow.timestamp_ns, slow.lamp_on_ns + 400'000'000);
    const FrameRecord& next = session.frames()[3];
    EXPECT_GE(next.timestamp_ns, next.lamp_on_ns + 400'000'000) << "the slow lamp has faded, too";
}

/// Lamps whose pictures are hard to tell apart are still told apart, without a single exposure too many.
TEST(CaptureRun, AcceptsLampsThatLookAlike) {
    for (const double contrast : {100.0, 50.0, 20.0}) {
        Bench bench;
        bench.camera.contrast = contrast;
        const Session session = bench.capture();
        EXPECT_TRUE(session.events().empty()) << "contrast " << contrast << ": " << test::events_of(session);
    }
}

TEST(CaptureRun, RejectsNoGoodFrameInManySessions) {
    for (int session_number = 0; session_number < 5; ++session_number) {
        Bench bench;
        bench.clock.sleep_for(std::chrono::microseconds(5237 * session_number));  // another phase of the camera
        const Session session = bench.capture();
        EXPECT_TRUE(session.events().empty()) << test::events_of(session);
    }
}

/// What is no rhythm is not predicted by: waiting for it cost every second lamp a try.
TEST(CaptureRun, ACameraSlowerThanItSaysTakesNoMoreTries) {
    Bench bench;
    bench.camera.real_period = milliseconds(75);
    bench.rig.capture.frame_deadline = Seconds(0.3);
    const Session session = bench.capture();
    test::expect_every_frame_right(session, bench.rig);
    EXPECT_TRUE(session.events().empty()) << test::events_of(session);
    EXPECT_EQ(bench.camera.starts, 1);
}

class BadPlan : public testing::Test {
protected:
    Bench bench;
    CapturePlan plan = plan_capture(bench.rig);

    std::string refusal() {
        const CameraInfo info = bench.camera.configure({});
        SessionWriter writer = SessionWriter::create(bench.folder.path() / "session",
                                                     session_info(bench.rig, info, "a cat", plan_capture(bench.rig)));
        try {
            SessionRecorder recorder(writer);
            run_capture(plan, bench.rig, {bench.lamps, bench.camera, bench.clock}, recorder);
        } catch (const InputError& error) {
            EXPECT_EQ(bench.camera.starts, 0) << "refused before hardware is touched";
            return error.what();
        }
        return "no error";
    }
};

TEST_F(BadPlan, WithoutShots) {
    plan.shots.clear();
    EXPECT_THAT(refusal(), testing::HasSubstr("no shots"));
}
TEST_F(BadPlan, WithoutADarkFrame) {
    plan.shots.erase(plan.shots.begin());
    EXPECT_THAT(refusal(), testing::HasSubstr("begins with 0001_lamp-01"));
}
TEST_F(BadPlan, WithALampThatIsNotThere) {
    plan.shots[2].lamp = LampId{4};
    EXPECT_THAT(refusal(), testing::HasSubstr("wants lamp 4; allowed: 0 to 3"));
}
TEST_F(BadPlan, LitByNoLamp) {
    plan.shots[2].lamp.reset();
    EXPECT_THAT(refusal(), testing::HasSubstr("neither dark nor of one lamp"));
}
TEST_F(BadPlan, WithMixedExposures) {
    plan.shots[2].camera.exposure = Seconds(1);
    EXPECT_THAT(refusal(), testing::HasSubstr("0002_lamp-02 has an exposure or gain of its own"));
}
TEST_F(BadPlan, ForOtherLamps) {
    bench.rig.lamps.pop_back();
    EXPECT_THAT(refusal(), testing::HasSubstr("describes 3 lamps, but its driver has 4"));
}

}  // namespace
}  // namespace darkbox
