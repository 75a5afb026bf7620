#include "rig/capture/capture_session.h"

#include <gmock/gmock.h>

#include <fstream>
#include <iterator>

#include "acquisition/device/device_error.h"
#include "tests/rig/capture/bench.h"

namespace darkbox {
namespace {

using test::Bench;
using testing::HasSubstr;

/// Asks for a stop at one call to clock, camera or lamps, counted from 0 over all of them.
void stop_at(Bench& bench, int moment, int& calls) {
    const test::Hook hook = [&bench, &calls, moment](const std::string&) {
        if (calls++ == moment) bench.stop.request_stop();
    };
    bench.clock.hook = bench.camera.hook = bench.lamps.hook = hook;
}

void forget_stop(Bench& bench) {
    bench.clock.hook = bench.camera.hook = bench.lamps.hook = nullptr;
    bench.stop = std::stop_source();
}

TEST(CaptureSession, KeepsTheRigAndSaysWhatItIs) {
    Bench bench;
    const Session session = bench.capture();
    EXPECT_EQ(session.info().object, "a cat");
    EXPECT_EQ(session.info().source, "capture");
    EXPECT_EQ(session.info().rig, "simulated-4");
    EXPECT_EQ(session.info().camera, "fake (0001)");
    EXPECT_EQ(session.info().planned_shots, 6);
    ASSERT_THAT(session.extras(), testing::ElementsAre("rig.toml"));
    std::ifstream in(session.path_of_extra("rig.toml"), std::ios::binary);
    EXPECT_EQ(std::string(std::istreambuf_iterator<char>(in), {}), bench.rig.toml);
}

/// Cancelled at moments all through the run: lamps are dark, and the session resumes to a complete one with every frame
/// right.
TEST(CaptureSession, IsCancelledAtAnyMomentAndResumes) {
    bool finished = false;
    int moment = 0;
    int resumed = 0;
    for (; !finished; moment += 4) {
        Bench bench;
        int calls = 0;
        stop_at(bench, moment, calls);
        try {
            bench.capture();
            finished = calls <= moment;
        } catch (const Cancelled&) {
            EXPECT_TRUE(bench.lamps.is_dark()) << "moment " << moment;
            forget_stop(bench);
            test::expect_every_frame_right(bench.capture(CaptureStart::resume), bench.rig);
            ++resumed;
        }
        if (testing::Test::HasFailure()) FAIL() << "moment " << moment;
    }
    EXPECT_GT(moment, 50);
    EXPECT_GT(resumed, moment / 4 * 3 / 4) << "only after the last frame a stop comes too late";
}

/// The same for a fault that nobody catches: the run dies where it stands.
TEST(CaptureSession, DiesAtAnyMomentAndResumes) {
    bool finished = false;
    for (int moment = 2; !finished; moment += 9) {
        Bench bench;
        int calls = 0;
        bool created = false;
        bench.clock.hook = bench.camera.hook = [&](const std::string&) {
            if (calls++ == moment) throw std::runtime_error("a bug");
        };
        try {
            bench.capture();
            finished = calls <= moment;
        } catch (const std::runtime_error&) {
            created = std::filesystem::exists(bench.request().folder);
            forget_stop(bench);
            EXPECT_TRUE(bench.lamps.is_dark()) << "moment " << moment;
            if (created) test::expect_every_frame_right(bench.capture(CaptureStart::resume), bench.rig);
        }
        if (testing::Test::HasFailure()) FAIL() << "moment " << moment;
    }
}

TEST(CaptureSession, ResumeTakesOnlyWhatIsMissing) {
    Bench bench;
    int lit = 0;
    bench.lamps.hook = [&](const std::string& call) {
        if (call == "light" && ++lit == 3) bench.stop.request_stop();
    };
    EXPECT_THAT(bench.error<Cancelled>(), HasSubstr("cancelled"));
    forget_stop(bench);
    std::vector<std::string> taken;
    WorkContext work;
    work.report = [&](const ProgressUpdate& update) { taken.push_back(update.detail); };
    const auto [session, summary, findings] =
        capture_session(bench.request(CaptureStart::resume), bench.rig, bench.lamps, bench.camera, bench.clock, work);
    EXPECT_EQ(summary.resumed, 3);
    EXPECT_EQ(summary.taken, 3);
    EXPECT_EQ(summary.repeated, 0);
    EXPECT_THAT(taken, testing::ElementsAre("lamp-03", "lamp-04", "dark", ""));
    test::expect_every_frame_right(session, bench.rig);
    EXPECT_THAT(test::events_of(session), HasSubstr("resumed with 3 of 6 frames"));
}

TEST(CaptureSession, ResumesTheLampsItWasBegunWith) {
    Bench bench;
    CaptureRequest request = bench.request();
    request.lamps = {"lamp-02", "lamp-04"};
    WorkContext work;
    work.stop = bench.stop.get_token();
    bench.lamps.hook = [&](const std::string& call) {
        if (call == "light") bench.stop.request_stop();
    };
    EXPECT_THROW(capture_session(request, bench.rig, bench.lamps, bench.camera, bench.clock, work), Cancelled);
    forget_stop(bench);

    request.start = CaptureStart::resume;
    request.lamps = {"lamp-01"};
    EXPECT_THROW(capture_session(request, bench.rig, bench.lamps, bench.camera, bench.clock), InputError);
    request.lamps = {};
    const Session session = capture_session(request, bench.rig, bench.lamps, bench.camera, bench.clock).session;
    ASSERT_EQ(session.frames().size(), 4);
    EXPECT_EQ(session.frames()[1].lamp_name, "lamp-02");
    EXPECT_EQ(session.frames()[2].lamp_name, "lamp-04");
}

TEST(CaptureSession, IsNotResumedWithAnotherRig) {
    Bench bench;
    bench.lamps.hook = [&](const std::string& call) {
        if (call == "light") bench.stop.request_stop();
    };
    bench.error<Cancelled>();
    forget_stop(bench);
    bench.rig.toml += "# changed\n";
    EXPECT_THAT(bench.error<InputError>(CaptureStart::resume), HasSubstr("was begun with another rig.toml"));
}

TEST(CaptureSession, WantsAFreshFolderOrAnInterruptedSession) {
    Bench bench;
    EXPECT_THROW(bench.capture(CaptureStart::resume), InputError);
    bench.capture();
    EXPECT_THROW(bench.capture(), InputError) << "it exists";
    EXPECT_THROW(bench.capture(CaptureStart::resume), InputError) << "it is sealed";
    EXPECT_TRUE(bench.lamps.is_dark());
}

TEST(CaptureSession, AnUnknownLampLeavesNothingBehind) {
    Bench bench;
    CaptureRequest request = bench.request();
    request.lamps = {"lamp-7"};
    EXPECT_THROW(capture_session(request, bench.rig, bench.lamps, bench.camera, bench.clock), InputError);
    EXPECT_FALSE(std::filesystem::exists(request.folder));
}

}  // namespace
}  // namespace darkbox
