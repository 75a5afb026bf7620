#include "rig/capture/lamp_timeline.h"

#include <gtest/gtest.h>

namespace darkbox {
namespace {

using std::chrono::milliseconds;

TimePoint at(int ms) { return TimePoint(milliseconds(ms)); }
constexpr Nanoseconds none{0};

/// Dark, then lamp 0 from 100 ms on, lamp 1 from 200 ms on, dark from 300 ms on; a call takes 2 ms, settling 5 and 10.
class LampTimelineTest : public testing::Test {
protected:
    LampTimelineTest() {
        timeline.switched({at(100), at(102)}, LampId{0});
        timeline.switched({at(200), at(202)}, LampId{1});
        timeline.switched({at(300), at(302)}, std::nullopt);
    }
    LampTimeline timeline{{milliseconds(5), milliseconds(10)}};
};

TEST_F(LampTimelineTest, NamesTheLampThatShoneAlone) {
    EXPECT_EQ(timeline.sole_light({at(120), at(150)}, none)->lamp, LampId{0});
    EXPECT_EQ(timeline.sole_light({at(212), at(300)}, none)->lamp, LampId{1});
    EXPECT_EQ(timeline.sole_light({at(212), at(300)}, none)->on, at(202));
    EXPECT_EQ(timeline.sole_light({at(50), at(100)}, none)->lamp, std::nullopt);
    EXPECT_EQ(timeline.sole_light({at(312), at(400)}, none)->lamp, std::nullopt);
}

TEST_F(LampTimelineTest, ASwitchASettlingAndAFadingLampSpoilAFrame) {
    EXPECT_FALSE(timeline.sole_light({at(90), at(101)}, none)) << "the call was under way";
    EXPECT_FALSE(timeline.sole_light({at(106), at(150)}, none)) << "lamp 0 comes up for 5 ms";
    EXPECT_TRUE(timeline.sole_light({at(107), at(150)}, none));
    EXPECT_FALSE(timeline.sole_light({at(150), at(201)}, none));
    EXPECT_FALSE(timeline.sole_light({at(211), at(250)}, none)) << "lamp 1 comes up for 10 ms";
    EXPECT_FALSE(timeline.sole_light({at(311), at(350)}, none)) << "and fades for as long";
    EXPECT_FALSE(timeline.sole_light({at(150), at(250)}, none));
    EXPECT_FALSE(timeline.sole_light({at(0), at(400)}, none));
}

TEST_F(LampTimelineTest, TheMarginCountsOnBothSides) {
    EXPECT_TRUE(timeline.sole_light({at(110), at(197)}, milliseconds(3)));
    EXPECT_FALSE(timeline.sole_light({at(109), at(197)}, milliseconds(3)));
    EXPECT_FALSE(timeline.sole_light({at(110), at(198)}, milliseconds(3)));
}

TEST_F(LampTimelineTest, SharesAreCutAtTheMiddleOfTheCalls) {
    EXPECT_DOUBLE_EQ(timeline.share(LampId{0}, {at(101), at(201)}), 1.0);
    EXPECT_DOUBLE_EQ(timeline.share(LampId{0}, {at(151), at(251)}), 0.5);
    EXPECT_DOUBLE_EQ(timeline.share(LampId{1}, {at(151), at(251)}), 0.5);
    EXPECT_DOUBLE_EQ(timeline.share(LampId{1}, {at(291), at(311)}), 0.5);
    EXPECT_DOUBLE_EQ(timeline.share(LampId{1}, {at(0), at(100)}), 0.0);
}

TEST_F(LampTimelineTest, DarkeningWhatIsDarkIsNoSwitch) {
    timeline.switched({at(400), at(402)}, std::nullopt);
    EXPECT_TRUE(timeline.sole_light({at(380), at(450)}, none));
    EXPECT_EQ(timeline.steady_from(), at(312));
}

/// Every moment of an exposure against a lamp that is on from 100 to 200 ms: never a frame that was not lit by it
/// alone.
TEST(LampTimeline, NoExposureSlipsThrough) {
    LampTimeline timeline{{milliseconds(0)}};
    timeline.switched({at(100), at(100)}, LampId{0});
    timeline.switched({at(200), at(200)}, std::nullopt);
    for (int begin = 0; begin < 300; ++begin) {
        for (const int length : {1, 30, 99, 100, 101, 180}) {
            const auto light = timeline.sole_light({at(begin), at(begin + length)}, none);
            const bool lit = begin >= 100 && begin + length <= 200;
            const bool dark = begin + length <= 100 || begin >= 200;
            ASSERT_EQ(light.has_value(), lit || dark) << begin << " " << length;
            ASSERT_EQ(light && light->lamp, lit) << begin << " " << length;
        }
    }
}

}  // namespace
}  // namespace darkbox
