#include "rig/capture/exposure_clock.h"

#include <gtest/gtest.h>

#include <random>

namespace darkbox {
namespace {

using std::chrono::microseconds;
using std::chrono::milliseconds;

constexpr Nanoseconds real_period = microseconds(33'400);  // and the camera says 33.333 ms
const TimePoint start{std::chrono::seconds(50)};

CameraInfo camera() {
    CameraInfo info;
    info.frame_period = Seconds(1.0 / 30);
    return info;
}

TimePoint begin_of(std::uint64_t sequence) { return start + real_period * static_cast<std::int64_t>(sequence); }

Frame frame(std::uint64_t sequence, Nanoseconds late = Nanoseconds(0)) {
    Frame frame;
    frame.sequence = sequence;
    frame.timestamp = begin_of(sequence) + late;
    frame.exposure = {frame.timestamp, frame.timestamp + milliseconds(20)};
    return frame;
}

TEST(ExposureClock, PredictsByTheRealPeriodAndNotTheOneTold) {
    ExposureClock clock(camera(), std::nullopt);
    for (std::uint64_t n = 3; n < 20; ++n) EXPECT_TRUE(clock.follow(frame(n)));
    ASSERT_TRUE(clock.locked());
    EXPECT_NEAR(to_seconds(clock.predicted(60).begin - begin_of(60)), 0, 1e-5);
    EXPECT_NEAR(to_seconds(clock.predicted(60).end - begin_of(60)), 0.020, 1e-5);
    EXPECT_EQ(clock.first_from(begin_of(41) - milliseconds(1)), 41);
    EXPECT_EQ(clock.first_from(begin_of(41) + milliseconds(1)), 42);
}

TEST(ExposureClock, TheMarginCoversTheJitter) {
    std::mt19937 random(1);
    for (int run = 0; run < 200; ++run) {
        std::uniform_int_distribution<int> jitter(0, 1500);
        ExposureClock clock(camera(), std::nullopt);
        for (std::uint64_t n = 0; n < 40; ++n) clock.follow(frame(n, microseconds(jitter(random))));
        ASSERT_TRUE(clock.locked());
        // Stamps are 0 to 1.5 ms late; the line goes through their middle.
        EXPECT_LE(std::abs(to_seconds(clock.predicted(41).begin - begin_of(41))), to_seconds(clock.margin()));
        EXPECT_LE(to_seconds(clock.margin()), 0.0021);
    }
}

TEST(ExposureClock, GapsInTheNumbersDoNoHarm) {
    ExposureClock clock(camera(), std::nullopt);
    for (std::uint64_t n = 0; n < 60; n += 1 + n % 4) EXPECT_TRUE(clock.follow(frame(n)));
    EXPECT_NEAR(to_seconds(clock.predicted(70).begin - begin_of(70)), 0, 1e-5);
}

TEST(ExposureClock, FindsStampsThatDoNotBelong) {
    ExposureClock clock(camera(), std::nullopt);
    for (std::uint64_t n = 0; n < 20; ++n) clock.follow(frame(n));
    EXPECT_FALSE(clock.follow(frame(20, milliseconds(5))));
    EXPECT_FALSE(clock.follow(frame(21, milliseconds(-5))));
    EXPECT_TRUE(clock.follow(frame(22)));
    EXPECT_FALSE(clock.follow(frame(22))) << "a number that comes again";
    EXPECT_NEAR(to_seconds(clock.predicted(30).begin - begin_of(30)), 0, 1e-5);
}

TEST(ExposureClock, FollowsANewRhythmThatStays) {
    ExposureClock clock(camera(), std::nullopt);
    for (std::uint64_t n = 0; n < 20; ++n) clock.follow(frame(n));
    for (std::uint64_t n = 20; n < 40; ++n) clock.follow(frame(n, milliseconds(11)));
    EXPECT_TRUE(clock.locked());
    EXPECT_NEAR(to_seconds(clock.predicted(50).begin - begin_of(50)), 0.011, 1e-5);
}

/// Such as delivers each frame when it can, or far fewer a second than it says.
TEST(ExposureClock, ACameraThatKeepsNoRhythmHasNone) {
    std::mt19937 random(2);
    std::uniform_int_distribution<int> pause_ms(60, 140);
    for (const bool steady : {false, true}) {
        ExposureClock clock(camera(), std::nullopt);
        TimePoint at = start;
        for (std::uint64_t n = 0; n < 60; ++n) {
            at += milliseconds(steady ? 66 : pause_ms(random));
            Frame late = frame(n);
            late.timestamp = at;
            late.exposure = {at, at + milliseconds(20)};
            EXPECT_TRUE(clock.follow(late)) << "a stamp is believed as long as nothing speaks against it";
            EXPECT_FALSE(clock.locked()) << n;
            if (n < 5) {
                EXPECT_EQ(clock.doubt(), Nanoseconds(0)) << "nothing is known yet";
            }
        }
        EXPECT_EQ(clock.doubt(), Nanoseconds(33'333'333)) << "one frame more, never longer";
        for (std::uint64_t n = 60; n < 100; ++n) {
            Frame again = frame(n);
            again.timestamp = at + real_period * static_cast<std::int64_t>(n - 59);
            clock.follow(again);
        }
        EXPECT_TRUE(clock.locked()) << "it keeps its rate again";
        EXPECT_EQ(clock.doubt(), Nanoseconds(0));
    }
}

TEST(ExposureClock, AMeasuredTimingTakesTheDriversPlace) {
    ExposureClock clock(camera(),
                        MeasuredTiming{milliseconds(-20), milliseconds(3), Nanoseconds(0), microseconds(100)});
    for (std::uint64_t n = 0; n < 20; ++n) clock.follow(frame(n));
    EXPECT_EQ(clock.exposure_of(frame(5)).begin, begin_of(5) - milliseconds(20));
    EXPECT_EQ(clock.exposure_of(frame(5)).end, begin_of(5) + milliseconds(3));
    EXPECT_NEAR(to_seconds(clock.predicted(30).begin - begin_of(30)), -0.020, 1e-5);
    EXPECT_GE(clock.margin(), microseconds(100));
}

}  // namespace
}  // namespace darkbox
