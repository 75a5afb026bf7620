#include <gtest/gtest.h>

#include <stdexcept>

#include "acquisition/device/device_error.h"
#include "sim/sim_rig.h"
#include "tests/sim/sim_test_support.h"

namespace darkbox::sim {
namespace {

SimRig streaming(const RigDescription& description, const FaultPlan& faults = {}) {
    SimRig rig = SimRig::make(description, faults);
    rig.camera().configure({});
    rig.camera().start();
    return rig;
}

/// The first frame whose whole exposure lies after this moment.
Frame next_after(SimRig& rig, TimePoint moment) {
    for (;;)
        if (Frame frame = next(rig); frame.exposure.begin >= moment) return frame;
}

TEST(SimCamera, TellsWhatIsInEffect) {
    RigDescription description = small_rig();
    description.sim.queue_depth = 3;
    SimRig rig = SimRig::make(description);
    const CameraInfo info = rig.camera().configure({Seconds{0.05}, 2.0});
    EXPECT_EQ(info.width, 64);
    EXPECT_EQ(info.height, 48);
    EXPECT_EQ(info.format, PixelFormat::rgb16);
    EXPECT_EQ(info.bit_depth, 12);
    EXPECT_EQ(info.black_level, 64);
    EXPECT_EQ(info.queue_depth, 3);
    EXPECT_EQ(info.latency_frames, 1);
    EXPECT_EQ(info.controls.gain, 2.0);
    EXPECT_GE(info.frame_period, Seconds{0.05});
    rig.camera().start();
    const Frame frame = next(rig);
    EXPECT_EQ(frame.pixels.size(), 64U * 48U * 6U);
    EXPECT_EQ(frame.status, FrameStatus::good);
}

TEST(SimCamera, EightBitsTakeOneByteEach) {
    RigDescription description = small_rig();
    description.sim.bit_depth = 8;
    SimRig rig = streaming(description);
    rig.lamps().light(LampId{2}, 1.0);
    const Frame frame = next(rig);
    EXPECT_EQ(frame.format, PixelFormat::rgb8);
    EXPECT_EQ(frame.pixels.size(), 64U * 48U * 3U);
    EXPECT_GT(mean_signal(frame), 5.0);
}

TEST(SimCamera, ALampLightsTheFramesExposedWhileItBurns) {
    SimRig rig = streaming(small_rig());
    const double dark = mean_signal(next(rig));
    EXPECT_NEAR(dark, 0.0, 0.2);
    for (std::uint32_t lamp = 0; lamp < 3; ++lamp) {
        rig.lamps().light(LampId{lamp}, 1.0);
        const Frame frame = next_after(rig, rig.clock().now());
        const ExposureTruth& truth = rig.camera().exposures().back();
        EXPECT_EQ(truth.sequence, frame.sequence);
        ASSERT_EQ(truth.lamps.size(), 1U);
        EXPECT_EQ(truth.lamps[0].lamp, LampId{lamp});
        EXPECT_NEAR(truth.lamps[0].share, 1.0, 1e-12);
        EXPECT_GT(mean_signal(frame), 200.0);
        rig.lamps().dark();
        EXPECT_NEAR(mean_signal(next_after(rig, rig.clock().now())), 0.0, 0.2);
        EXPECT_TRUE(rig.camera().exposures().back().lamps.empty());
    }
}

TEST(SimCamera, AnExposureThatStraddlesASwitchIsAMixture) {
    SimRig rig = streaming(small_rig());
    rig.lamps().light(LampId{0}, 1.0);
    const double first = mean_signal_right(next_after(rig, rig.clock().now()));
    rig.lamps().light(LampId{2}, 0.5);
    const Frame half_level = next_after(rig, rig.clock().now());
    const double second_half_level = mean_signal_right(half_level);

    rig.lamps().light(LampId{0}, 1.0);
    const Frame before = next_after(rig, rig.clock().now());
    const Nanoseconds period = to_nanoseconds(Seconds{1.0 / 30});
    rig.clock().sleep_until(before.exposure.begin + period + Nanoseconds(5'000'000));  // a quarter of 20 ms
    rig.lamps().light(LampId{2}, 0.5);
    const Frame mixed = next(rig);
    const auto& lamps = rig.camera().exposures().back().lamps;
    ASSERT_EQ(lamps.size(), 2U);
    EXPECT_NEAR(lamps[0].share, 0.25, 1e-6);
    EXPECT_NEAR(lamps[1].share, 0.5 * 0.75, 1e-6);
    EXPECT_NEAR(mean_signal_right(mixed), 0.25 * first + 0.75 * second_half_level, 1.0);
}

TEST(SimCamera, HalfLevelIsHalfTheLight) {
    SimRig rig = streaming(small_rig("torus-lambert"));
    rig.lamps().light(LampId{0}, 1.0);
    const Frame full = next_after(rig, rig.clock().now());
    rig.lamps().light(LampId{0}, 0.5);
    const Frame half = next_after(rig, rig.clock().now());
    EXPECT_GT(mean_signal_right(full), 300.0);
    EXPECT_NEAR(mean_signal_right(half) / mean_signal_right(full), 0.5, 0.003);
}

TEST(SimCamera, AFullQueueKeepsTheOldFramesAndLosesTheNewOnes) {
    RigDescription description = small_rig();
    description.sim.queue_depth = 2;
    SimRig rig = streaming(description);
    const TimePoint start = rig.clock().now();
    rig.clock().sleep_for(second);
    rig.lamps().light(LampId{0}, 1.0);
    const Frame stale = next(rig);
    EXPECT_EQ(stale.sequence, 0U);
    EXPECT_EQ(stale.timestamp, start);
    EXPECT_NEAR(mean_signal(stale), 0.0, 0.2) << "exposed before the lamp was lit";
    EXPECT_EQ(next(rig).sequence, 1U);
    const Frame fresh = next(rig);
    EXPECT_EQ(fresh.sequence, 30U);  // frames 0 to 29 were finished within the second
    EXPECT_GT(fresh.exposure.end, start + second);
}

TEST(SimCamera, NewControlsTakeEffectAfterTheLatency) {
    RigDescription description = small_rig();
    description.sim.latency_frames = 2;
    SimRig rig = streaming(description);
    rig.lamps().light(LampId{2}, 1.0);
    for (int i = 0; i < 4; ++i) next(rig);
    rig.camera().stop();
    rig.camera().configure({Seconds{0.01}, 1.0});
    rig.camera().start();
    std::vector<double> exposures;
    std::vector<double> signals;
    for (int i = 0; i < 4; ++i) {
        const Frame frame = next(rig);
        exposures.push_back(frame.controls.exposure.count());
        signals.push_back(sample(frame, 3 * (22 * 64 + 39)) - 64.0);
        EXPECT_EQ(to_seconds(frame.exposure.end - frame.exposure.begin), frame.controls.exposure.count());
    }
    EXPECT_EQ(exposures, (std::vector<double>{0.02, 0.02, 0.01, 0.01}));
    EXPECT_NEAR(signals[3] / signals[0], 0.5, 0.05);
}

TEST(SimCamera, WaitsInVirtualTimeAndRespectsTheDeadline) {
    SimRig rig = streaming(small_rig());
    const TimePoint start = rig.clock().now();
    EXPECT_THROW(rig.camera().next_frame(start + Nanoseconds(10'000'000)), DeadlineError);
    EXPECT_EQ(rig.clock().now(), start + Nanoseconds(10'000'000));
    next(rig);
    EXPECT_EQ(rig.clock().now(), start + Nanoseconds(24'000'000));  // 20 ms exposure, 4 ms read-out
    const Frame frame = next(rig);
    EXPECT_EQ(frame.sequence, 1U);
    EXPECT_EQ(frame.timestamp - start, to_nanoseconds(Seconds{1.0 / 30}));
}

TEST(SimCamera, IllegalCallsAreLogicErrors) {
    SimRig rig = SimRig::make(small_rig());
    const TimePoint later = rig.clock().now() + second;
    SimCamera& camera = rig.camera();
    EXPECT_THROW(camera.start(), std::logic_error);
    EXPECT_THROW(camera.next_frame(later), std::logic_error);
    EXPECT_NO_THROW(camera.stop());
    camera.configure({});
    EXPECT_THROW(camera.next_frame(later), std::logic_error);
    EXPECT_NO_THROW(camera.stop());
    camera.start();
    EXPECT_THROW(camera.start(), std::logic_error);
    EXPECT_THROW(camera.configure({}), std::logic_error);
    camera.stop();
    EXPECT_THROW(camera.next_frame(later), std::logic_error);
    EXPECT_NO_THROW(camera.configure({}));
    EXPECT_THROW(camera.configure({Seconds{0.0}, 1.0}), DeviceError);
    EXPECT_THROW(camera.configure({Seconds{0.02}, -1.0}), DeviceError);
}

TEST(SimLamps, RefusesWhatDoesNotExist) {
    SimRig rig = SimRig::make(small_rig());
    EXPECT_EQ(rig.lamps().size(), 3U);
    EXPECT_TRUE(rig.lamps().all_dark());
    EXPECT_THROW(rig.lamps().light(LampId{3}, 1.0), DeviceError);
    EXPECT_THROW(rig.lamps().light(LampId{0}, 0.0), DeviceError);
    EXPECT_THROW(rig.lamps().light(LampId{0}, 1.5), DeviceError);
    EXPECT_TRUE(rig.lamps().all_dark());
    rig.lamps().light(LampId{0}, 1.0);
    EXPECT_FALSE(rig.lamps().all_dark());
}

TEST(SimRig, SameSeedSameFrames) {
    const auto capture = [](std::uint64_t seed) {
        RigDescription description = small_rig();
        description.sim.seed = seed;
        SimRig rig = streaming(description);
        rig.lamps().light(LampId{1}, 1.0);
        next(rig);
        return next(rig).pixels;
    };
    EXPECT_EQ(capture(1), capture(1));
    EXPECT_NE(capture(1), capture(2));
}

TEST(SimRig, RefusesValuesOutOfRange) {
    RigDescription description = small_rig();
    description.sim.bit_depth = 20;
    try {
        SimRig::make(description);
        FAIL();
    } catch (const InputError& e) {
        EXPECT_STREQ(e.what(), "sim.bit_depth is 20, but must be 8 to 16");
    }
}

}  // namespace
}  // namespace darkbox::sim
