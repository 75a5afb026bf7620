// Frames without a lamp: between the lamps, and in a room that is not dark; and the order in which a manifest has them.
#include <gmock/gmock.h>

#include "tests/rig/capture/bench.h"

namespace darkbox {
namespace {

using test::Bench;
using test::files_of;
using testing::AllOf;
using testing::HasSubstr;

TEST(DarkFrames, ComeEverySoManyLamps) {
    Bench bench;
    bench.rig.capture.dark_every = 2;
    const Session session = bench.capture();
    session.verify();
    EXPECT_THAT(files_of(session),
                testing::ElementsAre("frames/0000_dark.tif", "frames/0001_lamp-01.tif", "frames/0002_lamp-02.tif",
                                     "frames/0003_dark.tif", "frames/0004_lamp-03.tif", "frames/0005_lamp-04.tif",
                                     "frames/0006_dark.tif"));
    EXPECT_TRUE(session.events().empty()) << test::events_of(session);
    EXPECT_THAT(session.frames()[3].verification, HasSubstr("against the first dark frame"));
}

/// Light that comes into the box once the second lamp went dark, and stays for so many frames.
struct LeakingDoor {
    explicit LeakingDoor(Bench& bench, int frames) {
        bench.rig.capture.dark_every = 2;
        bench.lamps.hook = [this](const std::string& call) {
            if (call == "light") ++lit;
            open = open || (call == "dark" && lit == 2);
        };
        bench.camera.tamper = [this, frames](Frame& frame, int) {
            if (!open || let_in == frames) return;
            ++let_in;
            for (std::size_t i = 1; i < frame.pixels.size(); i += 2)
                frame.pixels[i] = static_cast<std::byte>(std::to_integer<int>(frame.pixels[i]) + 1);
        };
    }
    int lit = 0;
    bool open = false;
    int let_in = 0;
};

TEST(DarkFrames, ADoorThatOpensIsFoundAtTheNextOneAndEndsTheCapture) {
    Bench bench;
    const LeakingDoor door(bench, 1000);
    EXPECT_THAT(bench.error<InputError>(),
                AllOf(HasSubstr("frame 0003_dark"), HasSubstr("differs from the first one by +0.063")));
    EXPECT_EQ(door.lit, 2) << "no lamp is lit in vain after that";
    EXPECT_TRUE(bench.lamps.is_dark());
    const SessionWriter left = SessionWriter::resume(bench.request().folder);
    EXPECT_EQ(left.acknowledged().size(), 1U) << "what was lit before it is in doubt";
}

/// The light may have come in while they were lit: nobody knows.
TEST(DarkFrames, OneThatDiffersForAMomentPutsThoseBeforeItInDoubt) {
    Bench bench;
    const LeakingDoor door(bench, 3);
    const Session session = bench.capture();
    session.verify();
    EXPECT_EQ(session.frames().size(), 7U);
    EXPECT_EQ(door.lit, 6) << "four lamps, and the first two once more";
    const std::string events = test::events_of(session);
    EXPECT_THAT(events, HasSubstr("0003_dark: try 1 of 3: the dark frame differs"));
    EXPECT_THAT(events, HasSubstr("0003_dark: it differed from the first one, so that the 2 frames before it are in "
                                  "doubt and taken again: lamp-01, lamp-02"));
    EXPECT_GT(session.frames()[1].timestamp_ns, session.frames()[0].timestamp_ns);
    EXPECT_LT(session.frames()[2].timestamp_ns, session.frames()[3].timestamp_ns) << "the dark frame came after them";
}

TEST(DarkFrames, LightThatComesInAgainAndAgainEndsTheCapture) {
    Bench bench;
    bench.rig.capture.dark_every = 2;
    int lit = 0, let_in = 0;
    bench.lamps.hook = [&](const std::string& call) {
        if (call == "light") ++lit, let_in = 0;
    };
    bench.camera.tamper = [&](Frame& frame,
                              int) {  // twelve frames after every two lamps, long enough for waits in distrust
        if (lit == 0 || lit % 2 != 0 || !bench.lamps.is_dark() || let_in == 12) return;
        ++let_in;
        for (std::size_t i = 1; i < frame.pixels.size(); i += 2)
            frame.pixels[i] = static_cast<std::byte>(std::to_integer<int>(frame.pixels[i]) + 1);
    };
    EXPECT_THAT(bench.error<InputError>(),
                AllOf(HasSubstr("frame 0003_dark"), HasSubstr("light came into the box 3 times while lamps were lit")));
    EXPECT_EQ(lit, 6);
    EXPECT_EQ(SessionWriter::resume(bench.request().folder).acknowledged().size(), 1U);
}

/// A late frame shows what is known: the last lamp's light.
TEST(DarkFrames, ALateFramePutsNothingInDoubt) {
    Bench bench;
    bench.rig.capture.dark_every = 2;
    int lit = 0;
    std::vector<std::byte> picture;
    TimePoint exposed;
    bool delivered = false;
    bench.lamps.hook = [&](const std::string& call) {
        if (call == "light") ++lit;
    };
    bench.camera.tamper = [&](Frame& frame, int) {
        if (!bench.lamps.is_dark() && lit == 2) picture = frame.pixels, exposed = frame.timestamp;
        if (!bench.lamps.is_dark() || lit != 2 || delivered) return;
        if (frame.timestamp < exposed + std::chrono::milliseconds(20)) return;
        delivered = true;
        frame.pixels = picture;
        frame.pixels[0] ^= std::byte{1};  // not bit for bit
    };
    const Session session = bench.capture();
    EXPECT_TRUE(delivered);
    EXPECT_EQ(lit, 4) << test::events_of(session);
}

TEST(DarkFrames, ALitRoomIsRefusedUnlessItIsDeclared) {
    const auto room = [](Frame& frame, int) {
        for (std::size_t i = 1; i < frame.pixels.size(); i += 2)
            frame.pixels[i] = static_cast<std::byte>(std::to_integer<int>(frame.pixels[i]) + 2);
    };
    Bench bench;
    bench.camera.tamper = room;
    EXPECT_THAT(bench.error<InputError>(), HasSubstr("the dark frame is bright"));
    Bench declared;
    declared.camera.tamper = room;
    declared.rig.capture.ambient = true;
    const Session session = declared.capture();
    EXPECT_EQ(session.frames().front().kind, FrameKind::ambient);
    EXPECT_EQ(session.frames().back().file, "frames/0005_ambient.tif");
    EXPECT_EQ(session.frames().size(), Bench::shots);
    EXPECT_TRUE(session.events().empty()) << test::events_of(session);
}

}  // namespace
}  // namespace darkbox
