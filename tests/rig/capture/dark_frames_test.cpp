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
}

TEST(DarkFrames, OneThatDiffersForAMomentIsTakenAgain) {
    Bench bench;
    const LeakingDoor door(bench, 3);
    const Session session = bench.capture();
    EXPECT_EQ(session.frames().size(), 7U);
    EXPECT_THAT(test::events_of(session), HasSubstr("0003_dark: try 1 of 3: the dark frame differs"));
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
