#include "rig/capture/flat_frames.h"

#include <fmt/format.h>
#include <gmock/gmock.h>

#include <filesystem>

#include "acquisition/session/bag.h"
#include "rig/capture/dose_book.h"
#include "tests/rig/capture/bench.h"

namespace darkbox {
namespace {

namespace fs = std::filesystem;
using test::Bench;
using test::files_of;
using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;

class FlatFramesTest : public testing::Test {
protected:
    Session capture(const CaptureRequest& asked) {
        WorkContext work;
        work.stop = bench_.stop.get_token();
        return capture_session(asked, bench_.rig, bench_.lamps, bench_.camera, bench_.clock, work).session;
    }
    CaptureRequest request(const std::string& name) const {
        CaptureRequest request = bench_.request();
        request.folder = bench_.folder.path() / name;
        return request;
    }
    Session card(const std::vector<std::string>& lamps = {}) {
        CaptureRequest asked = request("card");
        asked.kind = FrameKind::flat;
        asked.object = "";
        asked.lamps = lamps;
        return capture(asked);
    }
    CaptureRequest with_flats(const Session& flats) const {
        CaptureRequest asked = request("vase");
        asked.flats = flats.folder();
        return asked;
    }
    std::string refusal(const CaptureRequest& asked) {
        try {
            capture(asked);
        } catch (const InputError& error) {
            EXPECT_THAT(error.hint(), HasSubstr("darkbox capture --plan flat"));
            EXPECT_FALSE(fs::exists(asked.folder)) << "a refused capture leaves nothing behind";
            return error.what();
        }
        return "no error";
    }

    Bench bench_;
};

TEST_F(FlatFramesTest, AreTakenAndProvenAsLitOnesAre) {
    const Session session = card();
    session.verify();
    EXPECT_EQ(session.info().object, "flat");
    ASSERT_EQ(session.frames().size(), Bench::shots);
    for (const FrameRecord& record : session.frames()) {
        EXPECT_EQ(record.kind, record.lamp ? FrameKind::flat : FrameKind::dark);
        EXPECT_TRUE(record.verified) << record.file;
        const auto shares = test::lamps_in(read_frame(session.path_of(record), record), Bench::lamp_count);
        for (std::uint32_t lamp = 0; lamp < shares.size(); ++lamp)
            EXPECT_NEAR(shares[lamp], record.lamp == LampId{lamp} ? 1.0 : 0.0, 0.02) << record.file;
    }
}

TEST_F(FlatFramesTest, GoAlongWithAnObjectsFrames) {
    const Session flats = card();
    const Session session = capture(with_flats(flats));
    session.verify();
    EXPECT_EQ(session.info().flats, flats.reference());
    EXPECT_EQ(session.info().planned_shots, 12);
    EXPECT_THAT(
        files_of(session),
        ElementsAre("frames/0000_dark.tif", "frames/0001_lamp-01.tif", "frames/0002_lamp-02.tif",
                    "frames/0003_lamp-03.tif", "frames/0004_lamp-04.tif", "frames/0005_dark.tif",
                    "frames/flat/0000_dark.tif", "frames/flat/0001_lamp-01.tif", "frames/flat/0002_lamp-02.tif",
                    "frames/flat/0003_lamp-03.tif", "frames/flat/0004_lamp-04.tif", "frames/flat/0005_dark.tif"));
    for (std::size_t i = 0; i < 6; ++i) {
        EXPECT_EQ(session.frames()[i].taken_over_from, "");
        EXPECT_EQ(session.frames()[6 + i].taken_over_from, "card");
        EXPECT_EQ(session.frames()[6 + i].sha256, flats.frames()[i].sha256);
        EXPECT_EQ(session.frames()[6 + i].kind, flats.frames()[i].kind);
    }
    fs::remove_all(flats.folder());
    EXPECT_NO_THROW(Session::open(session.folder()).verify()) << "it stands without the card's";
}

TEST_F(FlatFramesTest, OfTheLampsAlone) {
    CaptureRequest asked = with_flats(card());
    asked.lamps = {"lamp-02", "lamp-04"};
    const Session session = capture(asked);
    EXPECT_THAT(files_of(session), Contains("frames/flat/0002_lamp-02.tif"));
    EXPECT_THAT(files_of(session), testing::Not(Contains("frames/flat/0001_lamp-01.tif")));
    EXPECT_EQ(session.frames().size(), 8U);
}

TEST_F(FlatFramesTest, AreCancelledAtAnyMomentAndResumed) {
    const Session flats = card();
    const auto whole = files_of(capture(with_flats(flats)));
    int resumed = 0;
    for (int moment = 0; moment < 40; moment += 3) {
        CaptureRequest asked = with_flats(flats);
        asked.folder = bench_.folder.path() / fmt::format("vase-{}", moment);
        int calls = 0;
        bench_.lamps.hook = [&](const std::string&) {
            if (calls++ == moment) bench_.stop.request_stop();
        };
        bool done = true;
        try {
            capture(asked);
        } catch (const Cancelled&) {
            done = false;
        }
        bench_.stop = std::stop_source();
        bench_.lamps.hook = {};
        if (!done && fs::exists(asked.folder)) {
            ++resumed;
            asked.flats = std::nullopt;
            asked.start = CaptureStart::resume;
            capture(asked);
        }
        if (!fs::exists(asked.folder)) continue;
        const Session session = Session::open(asked.folder);
        session.verify();
        EXPECT_EQ(files_of(session), whole) << moment;
    }
    EXPECT_GT(resumed, 2);
}

TEST_F(FlatFramesTest, OfACardAreResumedAsSuch) {
    CaptureRequest asked = request("card");
    asked.kind = FrameKind::flat;
    int lit = 0;
    bench_.lamps.hook = [&](const std::string& call) {
        if (call == "light" && ++lit == 3) bench_.stop.request_stop();
    };
    EXPECT_THROW(capture(asked), Cancelled);
    bench_.stop = std::stop_source();
    bench_.lamps.hook = {};
    asked.start = CaptureStart::resume;
    EXPECT_THROW(capture(asked), InputError) << "what it was begun as is its own to say";
    asked.kind = FrameKind::lit;
    const Session session = capture(asked);
    for (const FrameRecord& record : session.frames())
        EXPECT_EQ(record.kind, record.lamp ? FrameKind::flat : FrameKind::dark);
}

TEST_F(FlatFramesTest, OfOneLampAreTakenAgain) {
    const Session flats = card();
    CaptureRequest asked = request("card-2");
    asked.object = "";
    asked.retake = flats.folder();
    asked.lamps = {"lamp-03"};
    const Session again = capture(asked);
    EXPECT_EQ(again.info().object, "flat");
    const Session session = capture(with_flats(again));
    session.verify();
    int flat = 0;
    for (const FrameRecord& record : session.frames()) {
        if (record.kind != FrameKind::flat) continue;
        ++flat;
        EXPECT_EQ(record.taken_over_from, record.lamp_name == "lamp-03" ? "card-2" : "card");
    }
    EXPECT_EQ(flat, 4);
}

TEST_F(FlatFramesTest, SurviveAReTakeOfTheObject) {
    const Session flats = card();
    const Session old = capture(with_flats(flats));
    CaptureRequest asked = request("vase-2");
    asked.retake = old.folder();
    asked.lamps = {"lamp-01"};
    const Session session = capture(asked);
    session.verify();
    EXPECT_EQ(session.info().flats, flats.reference());
    EXPECT_EQ(std::ranges::count(session.frames(), FrameKind::flat, &FrameRecord::kind), 4);
    // And may be lent from there to the next object.
    CaptureRequest next = with_flats(session);
    next.folder = bench_.folder.path() / "cup";
    const Session cup = capture(next);
    cup.verify();
    EXPECT_EQ(std::ranges::count(cup.frames(), FrameKind::flat, &FrameRecord::kind), 4);
    EXPECT_EQ(cup.frames().size(), 12U);
}

TEST_F(FlatFramesTest, AreRefusedWhereTheyDoNotBelong) {
    const Session few = card({"lamp-01", "lamp-02"});
    EXPECT_THAT(refusal(with_flats(few)), HasSubstr("none of lamp 'lamp-03'"));
    const Session object = capture(request("object"));
    EXPECT_THAT(refusal(with_flats(object)), HasSubstr("none of lamp 'lamp-01'"));
    bench_.rig.name = "another";
    EXPECT_THAT(refusal(with_flats(few)), HasSubstr("captured by rig"));
}

/// Metering would light the object, for a capture that is refused.
TEST_F(FlatFramesTest, OfAnotherCameraAreRefusedBeforeAnythingIsLit) {
    CaptureRequest asked = with_flats(card());
    asked.exposure = ExposureChoice{};
    bench_.camera.id = "0002";
    int lit = 0;
    bench_.lamps.hook = [&](const std::string& call) { lit += call == "light" ? 1 : 0; };
    EXPECT_THAT(refusal(asked), HasSubstr("they are of the camera"));
    EXPECT_EQ(lit, 0);
}

/// A card bears any light; metering's counts as all light of the capture does.
TEST_F(FlatFramesTest, SpendNoObjectsBudget) {
    for (LampDescription& lamp : bench_.rig.lamps) lamp.dose_per_s = {1000, 0, 0};
    bench_.rig.dose.object_lux_s = 1;
    EXPECT_NO_THROW(card());
    EXPECT_GT(DoseBook(bench_.folder.path()).spent("flat").lux_s, 4 * 1000 * 0.02);
    EXPECT_THROW(capture(request("vase")), Error);
}

}  // namespace
}  // namespace darkbox
