#include "rig/capture/frame_source.h"

#include <gmock/gmock.h>

#include "acquisition/device/device_error.h"
#include "tests/rig/capture/fake_rig.h"

namespace darkbox {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

class FrameSourceTest : public testing::Test {
protected:
    test::FakeClock clock;
    test::FakeLamps lamps{clock, 2};
    test::FakeCamera camera{clock, lamps};
    WorkContext work;

    std::string rejection(const std::function<void(Frame&)>& tamper) {
        camera.tamper = nullptr;
        FrameSource source(camera, clock, {}, work);
        source.first_after(clock.now(), clock.now() + seconds(1));
        camera.tamper = [&](Frame& frame, int) { tamper(frame); };
        try {
            source.first_after(clock.now(), clock.now() + seconds(1));
        } catch (const DeviceError& error) {
            return error.what();
        }
        return "no error";
    }
};

TEST_F(FrameSourceTest, PassesOverFramesThatTheQueueHeldBack) {
    FrameSource source(camera, clock, {}, work);
    clock.sleep_for(seconds(1));  // the queue is full of frames as old as the start
    const TimePoint switched = clock.now();
    const Frame frame = source.first_after(switched, switched + seconds(1));
    EXPECT_GE(frame.exposure.begin, switched);
    EXPECT_LE(frame.exposure.end, clock.now());
    EXPECT_LE(frame.exposure.begin, switched + milliseconds(26)) << "the first one that will do";
    EXPECT_EQ(source.take_lost(), 0) << "what a full queue drops is not lost to this wait";
}

TEST_F(FrameSourceTest, BelievesADriverThatTellsTheLatestEndThereCouldBe) {
    camera.tamper = [&](Frame& frame, int) {
        frame.exposure.end = std::min(frame.timestamp + milliseconds(200), clock.now());
    };
    FrameSource source(camera, clock, {}, work);
    // Until the rhythm is known, each frame is told when it lay in the queue for long: with all of that bound.
    for (int i = 0; i < 12; ++i) {
        clock.sleep_for(seconds(1));
        source.next_until(clock.now() + seconds(1));
    }
    const TimePoint switched = clock.now();
    const Frame frame = source.first_after(switched, switched + seconds(1));
    EXPECT_GE(frame.exposure.begin, switched);
}

TEST_F(FrameSourceTest, CountsFramesLostWhileItWaits) {
    FrameSource source(camera, clock, {}, work);
    const TimePoint switched = clock.now();
    source.first_after(switched, switched + seconds(1));
    camera.lost = {1, 2};
    EXPECT_EQ(source.first_after(clock.now(), switched + seconds(1)).sequence, 3);
    EXPECT_EQ(source.take_lost(), 2);
    EXPECT_EQ(source.take_lost(), 0);
}

TEST_F(FrameSourceTest, RefusesDamagedAndMisfittingFrames) {
    EXPECT_THAT(rejection([](Frame& f) { f.status = FrameStatus::error; }), testing::HasSubstr("flagged as damaged"));
    EXPECT_THAT(rejection([](Frame& f) { f.status = FrameStatus::truncated; }),
                testing::HasSubstr("flagged as truncated"));
    EXPECT_THAT(rejection([](Frame& f) { f.pixels.pop_back(); }), testing::HasSubstr("truncated: 4799 of 4800 bytes"));
    EXPECT_THAT(rejection([](Frame& f) { f.width = 30; }), testing::HasSubstr("is 30x40 grey16 of 12 bits"));
    EXPECT_THAT(rejection([](Frame& f) { f.format = PixelFormat::grey8; }), testing::HasSubstr("grey8"));
    EXPECT_THAT(rejection([](Frame& f) { f.bit_depth = 10; }), testing::HasSubstr("of 10 bits, but"));
    EXPECT_THAT(rejection([](Frame& f) { f.controls.exposure = Seconds(0.01); }), testing::HasSubstr("for 0.01 s"));
    EXPECT_THAT(rejection([](Frame& f) { f.controls.gain = 2; }), testing::HasSubstr("at gain 2"));
}

TEST_F(FrameSourceTest, RefusesFramesOutOfOrderOrTime) {
    EXPECT_THAT(rejection([](Frame& f) { f.sequence = 0; }), testing::HasSubstr("repeated or out of order"));
    EXPECT_THAT(rejection([](Frame& f) { f.timestamp -= seconds(9); }), testing::HasSubstr("timestamp no later"));
    EXPECT_THAT(rejection([](Frame& f) { f.exposure.end += seconds(9); }), testing::HasSubstr("in the future"));
}

TEST_F(FrameSourceTest, GivesUpAtTheDeadlineAndRecoversOnce) {
    FrameSource source(camera, clock, {}, work);
    camera.hanging = true;
    const TimePoint deadline = clock.now() + seconds(2);
    EXPECT_THROW(source.first_after(clock.now(), deadline), DeadlineError);
    EXPECT_GE(clock.now(), deadline);
    EXPECT_LT(clock.now(), deadline + milliseconds(100));
    source.recover(std::chrono::seconds(1));
    source.recover(std::chrono::seconds(1));
    EXPECT_EQ(camera.starts, 2) << "a camera that works is left alone";
    EXPECT_NO_THROW(source.first_after(clock.now(), clock.now() + seconds(1)));
}

TEST_F(FrameSourceTest, ASlowCameraIsNotSaidToHang) {
    FrameSource source(camera, clock, {}, work);
    try {
        source.first_after(clock.now() + seconds(2), clock.now() + milliseconds(210));
        ADD_FAILURE() << "no DeadlineError";
    } catch (const DeadlineError& error) {
        EXPECT_THAT(error.what(), testing::HasSubstr("8 frames came, none of which began after the lamp was steady"));
    }
}

TEST_F(FrameSourceTest, IsCancelledWhileTheCameraHangs) {
    std::stop_source stop;
    work.stop = stop.get_token();
    FrameSource source(camera, clock, {}, work);
    camera.hanging = true;
    int calls = 0;
    camera.hook = [&](const std::string& call) {
        if (call == "next_frame" && ++calls == 3) stop.request_stop();
    };
    const TimePoint begin = clock.now();
    EXPECT_THROW(source.first_after(begin, begin + seconds(3600)), Cancelled);
    EXPECT_LT(clock.now(), begin + milliseconds(500));
}

TEST_F(FrameSourceTest, AnEndlessRowOfOldFramesMeetsTheDeadline) {
    FrameSource source(camera, clock, {}, work);
    camera.tamper = [](Frame& frame, int) { frame.exposure = {TimePoint(seconds(1)), TimePoint(seconds(2))}; };
    EXPECT_THROW(source.first_after(clock.now(), clock.now() + seconds(2)), DeadlineError);
}

}  // namespace
}  // namespace darkbox
