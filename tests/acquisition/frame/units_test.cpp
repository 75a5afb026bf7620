#include "acquisition/frame/units.h"

#include <gmock/gmock.h>

#include <type_traits>

#include "acquisition/frame/frame.h"
#include "acquisition/frame/ids.h"

namespace darkbox {
namespace {

TimePoint at(Nanoseconds::rep ns) { return TimePoint(Nanoseconds(ns)); }

TEST(Units, SecondsAndNanosecondsConvert) {
    EXPECT_EQ(to_nanoseconds(Seconds(0.25)), Nanoseconds(250'000'000));
    EXPECT_EQ(to_nanoseconds(Seconds(-1.5)), Nanoseconds(-1'500'000'000));
    EXPECT_DOUBLE_EQ(to_seconds(Nanoseconds(1'500'000'000)), 1.5);
}

TEST(Units, AnIntervalContainsWhatLiesWhollyInside) {
    const Interval steady{at(100), at(200)};
    EXPECT_TRUE(steady.contains({at(100), at(200)}));
    EXPECT_TRUE(steady.contains({at(120), at(180)}));
    EXPECT_FALSE(steady.contains({at(99), at(150)}));
    EXPECT_FALSE(steady.contains({at(150), at(201)}));
    EXPECT_FALSE(steady.contains({at(50), at(250)}));
}

TEST(Units, ABareNumberIsNoTimeAndNoId) {
    EXPECT_FALSE((std::is_convertible_v<double, Seconds>));
    EXPECT_FALSE((std::is_convertible_v<long, TimePoint>));
    EXPECT_FALSE((std::is_convertible_v<LampId, FrameIndex>));
    EXPECT_FALSE((std::is_convertible_v<int, LampId>));
}

TEST(Frame, PixelsAreNeverCopiedByAccident) {
    EXPECT_FALSE(std::is_copy_constructible_v<Frame>);
    EXPECT_FALSE(std::is_copy_assignable_v<Frame>);
    EXPECT_TRUE(std::is_nothrow_move_constructible_v<Frame>);
}

}  // namespace
}  // namespace darkbox
