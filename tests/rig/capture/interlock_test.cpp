#include "rig/capture/interlock.h"

#include "acquisition/device/device_error.h"
#include "rig/capture/light_by_hand.h"
#include "tests/rig/capture/bench.h"

namespace darkbox {
namespace {

using namespace test;
using testing::HasSubstr;

class ScriptedDoor final : public Door {
public:
    bool is_open() override {
        if (broken) throw DeviceError("the door's line cannot be read", "check its cable");
        return open;
    }
    bool open = false;
    bool broken = false;
};

class Interlock : public testing::Test {
protected:
    Session capture(CaptureStart start = CaptureStart::create) {
        return capture_session(bench.request(start), bench.rig, lamps, camera, bench.clock).session;
    }
    std::string refusal() {
        try {
            capture();
        } catch (const DoorOpen& error) {
            EXPECT_THAT(error.hint(), HasSubstr("resume"));
            return error.what();
        }
        return "none";
    }

    Bench bench;
    ScriptedDoor door;
    InterlockedLamps lamps{bench.lamps, door};
    InterlockedCamera camera{bench.camera, lamps};
};

TEST_F(Interlock, LetsACaptureBeWhileTheDoorIsClosed) { expect_every_frame_right(capture(), bench.rig); }

TEST_F(Interlock, LightsNothingBehindAnOpenDoor) {
    door.open = true;
    EXPECT_THROW(lamps.light(LampId{0}, 1.0), DoorOpen);
    EXPECT_TRUE(bench.lamps.is_dark());
    EXPECT_EQ(bench.lamps.longest_on(), Nanoseconds(0));
}

/// Opened at every frame of a capture in turn: dark at once, no second try, and the rest is taken once it is closed.
TEST_F(Interlock, EndsACaptureThatCanBeResumed) {
    for (int at = 0; at < 16; at += 3) {
        Bench fresh;
        ScriptedDoor switched;
        InterlockedLamps guarded(fresh.lamps, switched);
        InterlockedCamera watched(fresh.camera, guarded);
        fresh.camera.tamper = [&](Frame&, int number) { switched.open = number == at; };
        const auto run = [&](CaptureStart start) {
            return capture_session(fresh.request(start), fresh.rig, guarded, watched, fresh.clock).session;
        };
        EXPECT_THROW(run(CaptureStart::create), DoorOpen) << at;
        EXPECT_TRUE(fresh.lamps.is_dark()) << at;
        EXPECT_EQ(fresh.camera.delivered, at + 1) << "a frame was taken behind an open door";
        switched.open = false;
        fresh.camera.tamper = {};
        const Session session = run(CaptureStart::resume);
        expect_every_frame_right(session, fresh.rig);
    }
}

TEST_F(Interlock, IsNoticedWhileTheCameraHangs) {
    int waits = 0;
    bench.camera.hook = [&](const std::string& call) {
        bench.camera.hanging = true;
        if (call == "next_frame" && ++waits == 3) door.open = true;
    };
    const TimePoint before = bench.clock.now();
    EXPECT_EQ(refusal(), "the door of the box is open");
    EXPECT_LT(to_seconds(bench.clock.now() - before), 0.25);
    EXPECT_TRUE(bench.lamps.is_dark());
}

/// No frame is waited for then, and nothing else is lit.
TEST_F(Interlock, DarkensALampLitByHandWithin50Milliseconds) {
    TimePoint opened;
    bench.clock.hook = [&, waits = 0](const std::string& call) mutable {
        if (call != "sleep_until" || ++waits != 5) return;
        door.open = true;
        opened = bench.clock.now();
    };
    const HandLight light = light_by_hand(bench.rig, "lamp-02", Seconds(1), "");
    EXPECT_THROW(shine(light, bench.rig, lamps, bench.clock, bench.folder.path(), {}, [this] { lamps.watch(); }),
                 DoorOpen);
    ASSERT_TRUE(door.open);
    EXPECT_LT(bench.clock.now() - opened, std::chrono::milliseconds(50));
    EXPECT_TRUE(bench.lamps.is_dark());
    EXPECT_GT(bench.lamps.longest_on(), std::chrono::milliseconds(60)) << "it was lit when the door opened";
}

TEST_F(Interlock, TakesADoorThatCannotBeReadForOpen) {
    lamps.light(LampId{0}, 1.0);
    door.broken = true;
    EXPECT_THROW(lamps.watch(), DeviceError);
    EXPECT_TRUE(bench.lamps.is_dark());
}

}  // namespace
}  // namespace darkbox
