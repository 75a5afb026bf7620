#include <gmock/gmock.h>

#include <array>
#include <stdexcept>

#include "acquisition/device/device_error.h"
#include "tests/rig/capture/bench.h"

namespace darkbox {
namespace {

using std::chrono::milliseconds;
using test::Bench;
using testing::AllOf;
using testing::HasSubstr;

/// The capture gets over the fault, notes it, and every frame is right.
void expect_overcome(Bench& bench, const std::string& noted) {
    const Session session = bench.capture();
    test::expect_every_frame_right(session, bench.rig);
    EXPECT_THAT(test::events_of(session), HasSubstr(noted));
    EXPECT_TRUE(bench.lamps.is_dark());
}

TEST(TimestampsThatLie, ByAFrameFromTheStart) {
    Bench bench;
    bench.camera.lie = [](std::uint64_t) { return milliseconds(50); };
    expect_overcome(bench, "0001_lamp-01: try 1 of 3");
}

TEST(TimestampsThatLie, ByAnyTimeFromTheStart) {
    for (const int late : {3, 10, 15, 20, 28, 35, 40, 65, 90}) {
        Bench bench;
        bench.camera.lie = [=](std::uint64_t) { return milliseconds(late); };
        test::expect_every_frame_right(bench.capture(), bench.rig);
    }
}

TEST(TimestampsThatLie, NowAndThenByALamp) {
    for (std::uint64_t at = 0; at < 20; at += 2) {
        Bench bench;
        bench.camera.lie = [=](std::uint64_t sequence) { return milliseconds(sequence / 4 == at / 4 ? 75 : 0); };
        test::expect_every_frame_right(bench.capture(), bench.rig);
    }
}

TEST(TimestampsThatLie, FrameOfThePreviousLamp) {
    Bench bench;
    int lit = 0;
    bool late = false;
    bench.lamps.hook = [&](const std::string& call) {
        if (call == "light") late = ++lit == 3;
    };
    bench.camera.lie = [&](std::uint64_t) { return milliseconds(late ? 85 : 0); };
    expect_overcome(bench, "0003_lamp-03: try 1 of 3");
}

TEST(TimestampsThatLie, ForEverEndInAnErrorThatNamesTheLamp) {
    Bench bench;
    bench.camera.lie = [](std::uint64_t) { return std::chrono::hours(1); };
    EXPECT_THAT(bench.error<InputError>(),
                AllOf(HasSubstr("lamp 'lamp-01', frame 0001_lamp-01"), HasSubstr("as dark as the dark frame")));
    EXPECT_TRUE(bench.lamps.is_dark());
}

TEST(CameraFaults, LostFramesAreNoted) {
    Bench bench;
    for (std::uint64_t n = 1; n < 12; n += 1) bench.camera.lost.insert(n);
    expect_overcome(bench, "the camera lost");
}

TEST(CameraFaults, EveryFrameMayBeTheDamagedOne) {
    for (const FrameStatus status : {FrameStatus::error, FrameStatus::truncated}) {
        int noted = 0;
        for (int damaged = 0; damaged < 28; ++damaged) {
            Bench bench;
            bench.camera.tamper = [&](Frame& frame, int number) {
                if (number == damaged) frame.status = status;
            };
            const Session session = bench.capture();
            test::expect_every_frame_right(session, bench.rig);
            if (!session.events().empty()) ++noted;
        }
        EXPECT_GE(noted, static_cast<int>(Bench::shots)) << "those that were to be kept are taken again, and noted";
    }
}

TEST(CameraFaults, AlwaysDamagedIsAnErrorThatNamesTheFrame) {
    Bench bench;
    bench.camera.tamper = [](Frame& frame, int) { frame.status = FrameStatus::error; };
    EXPECT_THAT(bench.error<DeviceError>(),
                AllOf(HasSubstr("frame 0000_dark"), HasSubstr("no good frame in 3 tries"), HasSubstr("damaged")));
}

/// Delivers the pixels of the last lamp's frame again, with fresh numbers and times: only the picture tells.
TEST(CameraFaults, RepeatedPixels) {
    Bench bench;
    std::array<std::vector<std::byte>, 2> kept;
    int lit = 0;
    bench.lamps.hook = [&](const std::string& call) {
        if (call == "light") ++lit;
    };
    bench.camera.tamper = [&](Frame& frame, int number) {
        auto& slot = kept[static_cast<std::size_t>(number % 2)];
        if (lit < 4) slot = frame.pixels;
        if (lit == 4) frame.pixels = slot;
    };
    expect_overcome(bench, "0004_lamp-04: try 1 of 3: the camera delivered one picture twice, bit for bit");
}

TEST(CameraFaults, RepeatedBuffer) {
    Bench bench;
    std::uint64_t sequence = 0;
    TimePoint timestamp;
    bench.camera.tamper = [&](Frame& frame, int number) {
        if (number == 6) {
            frame.sequence = sequence;
            frame.timestamp = timestamp;
        }
        sequence = frame.sequence;
        timestamp = frame.timestamp;
    };
    test::expect_every_frame_right(bench.capture(), bench.rig);
}

TEST(CameraFaults, AHangIsOvercomeByARestart) {
    Bench undisturbed;
    undisturbed.capture();
    for (int hangs_at = 0; hangs_at < undisturbed.camera.delivered; ++hangs_at) {
        Bench bench;
        int calls = 0;
        bench.camera.hook = [&](const std::string& call) {
            if (call == "next_frame" && calls++ == hangs_at) bench.camera.hanging = true;
        };
        const Session session = bench.capture();
        test::expect_every_frame_right(session, bench.rig);
        EXPECT_EQ(bench.camera.starts, 2) << hangs_at;
        EXPECT_LE(to_seconds(bench.lamps.longest_on()), bench.rig.lamps[0].max_on.count() + 0.001);
    }
}

TEST(CameraFaults, AHangForEverIsAnErrorWithinItsDeadlines) {
    Bench bench;
    const TimePoint begin = bench.clock.now();
    bench.camera.hook = [&](const std::string& call) {
        if (call == "next_frame" && bench.camera.delivered == 5)
            bench.camera.hanging = bench.camera.hangs_for_ever = true;
    };
    EXPECT_THAT(bench.error<DeviceError>(), AllOf(HasSubstr("lamp 'lamp-0"), HasSubstr("no good frame in 3 tries"),
                                                  HasSubstr("delivered nothing")));
    EXPECT_TRUE(bench.lamps.is_dark());
    // Once in the light, for as long as the lamp bears; then twice in the dark, for frame_deadline.
    EXPECT_LT(to_seconds(bench.clock.now() - begin), 2.1 + 2 * 5.1 + 1);
    EXPECT_LE(to_seconds(bench.lamps.longest_on()), bench.rig.lamps[0].max_on.count() + 0.001);
}

TEST(CameraFaults, AFailingCallIsTriedAgainABoundedNumberOfTimes) {
    for (const int failures : {1, 2, 3}) {
        Bench bench;
        int failed = 0;
        bench.camera.hook = [&](const std::string& call) {
            if (call == "next_frame" && bench.camera.delivered >= 5 && failed < failures) {
                ++failed;
                throw DeviceError("ioctl VIDIOC_DQBUF /dev/video0: no such device", "plug it in");
            }
        };
        if (failures < 3) {
            test::expect_every_frame_right(bench.capture(), bench.rig);
            EXPECT_EQ(bench.camera.starts, 1 + failures);
        } else {
            EXPECT_THAT(bench.error<DeviceError>(), AllOf(HasSubstr("lamp 'lamp-0"), HasSubstr("VIDIOC_DQBUF")));
        }
        EXPECT_TRUE(bench.lamps.is_dark());
    }
}

TEST(CameraFaults, AnyExceptionLeavesTheLampsDark) {
    for (const std::string failing : {"configure", "start", "next_frame"}) {
        Bench bench;
        bench.camera.hook = [&](const std::string& call) {
            if (call == failing && (call != "next_frame" || !bench.lamps.is_dark())) throw std::runtime_error("a bug");
        };
        EXPECT_THROW(bench.capture(), std::runtime_error) << failing;
        EXPECT_TRUE(bench.lamps.is_dark()) << failing;
    }
}

TEST(CameraFaults, ACameraInAnotherStateIsABugThatLeavesTheLampsDark) {
    Bench bench;
    bench.camera.configure({});
    bench.camera.start();
    EXPECT_THROW(bench.capture(), std::logic_error);
    EXPECT_TRUE(bench.lamps.is_dark());
    bench.camera.stop();
    Bench again;
    again.camera.configure({});
    test::expect_every_frame_right(again.capture(), again.rig);
    EXPECT_EQ(again.camera.starts, 1) << "a ready camera is as good as a closed one";
}

TEST(LampFaults, ADeadLampIsNamed) {
    Bench bench;
    bench.lamps.dead = {2};
    EXPECT_THAT(bench.error<InputError>(), AllOf(HasSubstr("lamp 'lamp-03', frame 0003_lamp-03"),
                                                 HasSubstr("no good frame in 3 tries"), HasSubstr("as dark as")));
    EXPECT_TRUE(bench.lamps.is_dark());
}

TEST(LampFaults, ALampThatIsOnFromTheStartShowsInTheFirstDarkFrame) {
    Bench bench;
    bench.lamps.stuck = {1, TimePoint()};
    EXPECT_THAT(bench.error<InputError>(), AllOf(HasSubstr("frame 0000_dark"), HasSubstr("the dark frame is bright")));
}

TEST(LampFaults, ALampThatSticksIsNamedByTheClosingDarkFrame) {
    Bench bench;
    int lit = 0;
    bench.lamps.hook = [&](const std::string& call) {
        if (call == "light" && ++lit == 4) bench.lamps.stuck = {1, bench.clock.now()};
    };
    EXPECT_THAT(bench.error<InputError>(), AllOf(HasSubstr("frame 0005_dark"), HasSubstr("differs from the first"),
                                                 HasSubstr("it looks lit by lamp 'lamp-02'")));
}

TEST(LampFaults, WhatADarkFramePutInDoubtIsTakenAgainOnResume) {
    Bench bench;
    int lit = 0;
    bench.lamps.hook = [&](const std::string& call) {
        if (call == "light" && ++lit == 4) bench.lamps.stuck = {1, bench.clock.now()};
    };
    bench.error<InputError>();
    {
        const SessionWriter left = SessionWriter::resume(bench.request().folder);
        ASSERT_EQ(left.acknowledged().size(), 1U) << "the first dark frame alone is beyond doubt";
    }
    bench.lamps.stuck.reset();
    const Session session = bench.capture(CaptureStart::resume);
    test::expect_every_frame_right(session, bench.rig);
    EXPECT_EQ(lit, 8);
    EXPECT_THAT(test::events_of(session),
                HasSubstr("0005_dark: it differed from the first one, so that the 4 frames before it are in doubt and "
                          "taken again: lamp-01, lamp-02, lamp-03, lamp-04"));
}

/// As an earlier darkbox left it.
TEST(LampFaults, ASessionWithAFrameThatWasNotVerifiedIsNotResumed) {
    Bench bench;
    bench.interrupt_at_lamp(3);
    {
        SessionWriter left = SessionWriter::resume(bench.request().folder);
        FrameRecord record = left.acknowledged().back();
        record.file = "frames/0005_dark.tif";
        record.verification = "it differed";
        record.verified = false;
        left.take_over(left.folder() / "data" / left.acknowledged().back().file, record);
    }
    EXPECT_THAT(bench.error<InputError>(CaptureStart::resume), HasSubstr("cannot be resumed: frame frames/0005_dark"));
}

TEST(LampFaults, ALampThatStuckDuringABreakIsFound) {
    Bench bench;
    bench.interrupt_at_lamp(3);
    bench.lamps.stuck = {0, bench.clock.now()};
    EXPECT_THAT(bench.error<InputError>(CaptureStart::resume), HasSubstr("differs from the first"));
}

TEST(LampFaults, AFailingSwitchIsTriedAgain) {
    Bench bench;
    int lit = 0;
    bench.lamps.hook = [&](const std::string& call) {
        if (call == "light" && ++lit == 2) throw DeviceError("the lamp controller does not answer", "plug it in");
    };
    expect_overcome(bench, "0002_lamp-02: try 1 of 3: the lamp controller does not answer");
}

TEST(LampFaults, DarknessThatCannotBeConfirmedIsAnError) {
    Bench bench;
    bool gone = false;
    bench.lamps.hook = [&](const std::string& call) {
        if (call == "light") gone = true;
        if (gone && call == "dark") throw DeviceError("the lamp controller is gone", "plug it in");
    };
    EXPECT_THAT(bench.error<DeviceError>(), HasSubstr("the lamp controller is gone"));
}

}  // namespace
}  // namespace darkbox
