#include <fmt/format.h>

#include <fstream>

#include "rig/capture/dosed_lamps.h"
#include "rig/capture/light_dose.h"
#include "tests/rig/capture/bench.h"

namespace darkbox {
namespace {

using namespace test;
using testing::HasSubstr;

/// Every lamp gives 1000 lux, 2 W/m2 of ultraviolet and 3 W/m2 of infrared.
RigDescription bright(RigDescription rig, std::optional<double> object_lux_s = {}) {
    for (LampDescription& lamp : rig.lamps) lamp.dose_per_s = {1000, 2, 3};
    rig.dose.object_lux_s = object_lux_s;
    return rig;
}

class LightDoses : public testing::Test {
protected:
    std::unique_ptr<DosedLamps> dosed(const RigDescription& described, DoseBook& book,
                                      const std::string& object = "vase") {
        return std::make_unique<DosedLamps>(bench.lamps, bench.clock, described, book, object, "s");
    }
    void wait(double seconds) { bench.clock.sleep_until(bench.clock.now() + to_nanoseconds(Seconds(seconds))); }

    Bench bench;
    RigDescription rig = bright(bench.rig);
};

TEST_F(LightDoses, AddUpFromSwitchToSwitch) {
    DoseBook book(bench.folder.path());
    auto lamps = dosed(rig, book);
    lamps->light(LampId{0}, 1.0);
    wait(0.5);
    lamps->light(LampId{1}, 0.5);
    wait(0.25);
    lamps->dark();
    wait(10);
    EXPECT_NEAR(lamps->given().lux_s, 625, 1);
    EXPECT_NEAR(lamps->given().uv_j_per_m2, 1.25, 0.01);
    EXPECT_NEAR(lamps->given().ir_j_per_m2, 1.875, 0.01);
    lamps->finish();
    EXPECT_NEAR(book.spent("vase").lux_s, 625, 1);
    EXPECT_EQ(book.spent("cup").lux_s, 0);
}

TEST_F(LightDoses, AreKeptOverRunsAndAlsoWhenARunIsThrownOut) {
    for (int run = 0; run < 3; ++run) {
        DoseBook book(bench.folder.path());
        const auto lamps = dosed(rig, book);
        lamps->light(LampId{0}, 1.0);
        wait(0.1);  // and is left lit: the destructor darkens
    }
    EXPECT_NEAR(DoseBook(bench.folder.path()).spent("vase").lux_s, 300, 1);
    EXPECT_TRUE(bench.lamps.is_dark());
}

TEST_F(LightDoses, LoseAtMostASecondOfLightInACrash) {
    DoseBook book(bench.folder.path());
    const auto lamps = dosed(rig, book);
    for (int i = 0; i < 25; ++i) {
        lamps->light(LampId{0}, 1.0);
        wait(0.1);
        lamps->dark();
        EXPECT_GE(DoseBook(bench.folder.path()).spent("vase").lux_s, lamps->given().lux_s - 1000) << i;
    }
}

TEST_F(LightDoses, RefuseTheLampThatWouldBeTooMuch) {
    const RigDescription limited = bright(bench.rig, 500);
    DoseBook book(bench.folder.path());
    const auto lamps = dosed(limited, book);
    lamps->light(LampId{0}, 1.0);
    wait(0.48);
    try {
        lamps->light(LampId{1}, 1.0);
        FAIL();
    } catch (const DoseExceeded& error) {
        EXPECT_THAT(error.what(), HasSubstr("'vase' has had 480 of 500 lux seconds"));
        EXPECT_THAT(error.hint(), HasSubstr("object_lux_s"));
    }
    EXPECT_TRUE(bench.lamps.is_dark());
    EXPECT_LE(lamps->given().lux_s, 500);
}

TEST_F(LightDoses, OfExemptObjectsAreCountedOnly) {
    const RigDescription limited = bright(bench.rig, 1);
    DoseBook book(bench.folder.path());
    const auto lamps = dosed(limited, book, "recalibration");
    lamps->light(LampId{0}, 1.0);
    wait(1);
    lamps->finish();
    EXPECT_NEAR(book.spent("recalibration").lux_s, 1000, 1);
}

TEST_F(LightDoses, OfACaptureAreThoseOfItsLampsAndAreNoted) {
    bench.rig = rig;
    const Session session = bench.capture();
    const double spent = DoseBook(bench.folder.path()).spent("a cat").lux_s;
    EXPECT_GT(spent, 4 * 1000 * (rig.lamps[0].settle + rig.camera.exposure).count());
    EXPECT_LT(spent, 4 * 1000 * 0.5);
    EXPECT_THAT(events_of(session), HasSubstr(fmt::format("light dose: {:.4g} lux s", spent)));
}

TEST_F(LightDoses, RefuseACaptureThatCannotEndBeforeAnythingIsLit) {
    bench.rig = bright(bench.rig, 50);  // four lamps take 100 at least
    EXPECT_THAT(bench.error<DoseExceeded>(), HasSubstr("'a cat' has had 0 of 50 lux seconds"));
    EXPECT_EQ(DoseBook(bench.folder.path()).spent("a cat").lux_s, 0);
}

/// The second try of a refused budget goes on where the first was, once the budget is raised.
TEST_F(LightDoses, LeaveASessionThatCanBeResumed) {
    bench.rig = bright(bench.rig, 150);
    const std::string toml = bench.rig.toml;
    EXPECT_THAT(bench.error<DoseExceeded>(), HasSubstr("of 150 lux seconds"));
    const double before = DoseBook(bench.folder.path()).spent("a cat").lux_s;
    EXPECT_GT(before, 0);
    bench.rig.dose.object_lux_s = 100'000;
    expect_every_frame_right(bench.capture(CaptureStart::resume), bench.rig);
    EXPECT_GT(DoseBook(bench.folder.path()).spent("a cat").lux_s, before);
}

TEST_F(LightDoses, CountExposuresThatHadToBeTakenAgain) {
    bench.rig = rig;
    bench.capture();
    const double plain = DoseBook(bench.folder.path()).spent("a cat").lux_s;
    Bench repeated;
    repeated.rig = bright(repeated.rig);
    int lit = 0;
    repeated.camera.tamper = [&](Frame& frame, int) {
        if (!repeated.lamps.is_dark() && ++lit <= 3) frame.status = FrameStatus::error;
    };
    repeated.capture();
    EXPECT_GT(DoseBook(repeated.folder.path()).spent("a cat").lux_s, plain);
}

TEST_F(LightDoses, InATornBookCountAsFarAsTheyGo) {
    std::filesystem::create_directories(bench.folder.path() / ".darkbox");
    const auto file = bench.folder.path() / ".darkbox" / "dose.jsonl";
    const std::string line = R"({"object":"vase","lux_s":5,"uv_j_per_m2":0,"ir_j_per_m2":0})";
    std::ofstream(file) << line << "\n" << line.substr(0, 20);
    DoseBook book(bench.folder.path());
    EXPECT_EQ(book.spent("vase").lux_s, 5);
    book.add("vase", "s", {2, 0, 0});
    EXPECT_EQ(DoseBook(bench.folder.path()).spent("vase").lux_s, 7);
}

TEST_F(LightDoses, InABookThatCannotBeReadAreNotTakenForNone) {
    std::filesystem::create_directories(bench.folder.path() / ".darkbox");
    for (const char* line :
         {R"({"object":"vase"})", R"({"object":"vase","lux_s":-5,"uv_j_per_m2":0,"ir_j_per_m2":0})"}) {
        std::ofstream(bench.folder.path() / ".darkbox" / "dose.jsonl") << line << "\n";
        EXPECT_THROW(DoseBook(bench.folder.path()), InputError) << line;
    }
}

}  // namespace
}  // namespace darkbox
