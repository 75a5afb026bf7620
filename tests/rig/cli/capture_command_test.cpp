// `darkbox capture` as a person or a script runs it, in a process of its own, on the simulated rig.
#include <gmock/gmock.h>

#include <fstream>
#include <nlohmann/json.hpp>

#include "acquisition/session/session.h"
#include "tests/rig/cli/captured_frames.h"
#include "tests/rig/cli/program.h"
#include "tests/support/test_data.h"

namespace darkbox {
namespace {

namespace fs = std::filesystem;
using test::darkbox_program;
using testing::HasSubstr;

class CaptureCommand : public testing::Test {
protected:
    CaptureCommand() { std::ofstream(rig_) << test::small_rig(6); }

    test::ProgramResult capture(const std::vector<std::string>& more) const {
        std::vector<std::string> arguments{"capture", "--standalone", "--json"};
        arguments.insert(arguments.end(), more.begin(), more.end());
        return darkbox_program(arguments);
    }

    test::TemporaryFolder folder_;
    const fs::path rig_ = folder_.path() / "rig.toml";
    const fs::path vase_ = folder_.path() / "vase";
    const fs::path again_ = folder_.path() / "vase-2";
};

TEST_F(CaptureCommand, TakesALampAgainIntoASessionThatProcesses) {
    ASSERT_EQ(capture({"--rig", rig_, "--out", vase_}).status, 0);
    const auto retaken = capture({"--retake", vase_, "--lamps", "lamp-03", "--out", again_});
    ASSERT_EQ(retaken.status, 0) << retaken.err;
    EXPECT_EQ(nlohmann::json::parse(retaken.out).at("frames"), 10);
    const auto verified = darkbox_program({"verify", again_, "--json"});
    EXPECT_EQ(verified.status, 0) << verified.err;
    const auto retakes = nlohmann::json::parse(verified.out).at("retakes");
    EXPECT_EQ(retakes, nlohmann::json({{"session", "vase"}, {"found", true}, {"unchanged", true}}));
    const auto listed = darkbox_program({"sessions", "--folder", folder_.path()});
    EXPECT_THAT(listed.out, HasSubstr("retakes vase"));
    const auto processed = darkbox_program({"process", again_});
    EXPECT_EQ(processed.status, 0) << processed.err;
    const auto evaluated = darkbox_program({"evaluate", again_, "--json"});
    EXPECT_EQ(evaluated.status, 0) << evaluated.err;
}

TEST_F(CaptureCommand, MetersAndSaysSo) {
    const auto metered = capture({"--rig", rig_, "--out", vase_, "--exposure", "auto"});
    ASSERT_EQ(metered.status, 0) << metered.err;
    const Session session = Session::open(vase_);
    ASSERT_FALSE(session.events().empty());
    EXPECT_THAT(session.events().front().what, HasSubstr("metered: exposure"));
    ASSERT_EQ(capture({"--rig", rig_, "--out", again_, "--exposure", "7500"}).status, 0);
    EXPECT_DOUBLE_EQ(Session::open(again_).frames().front().exposure_s, 0.0075);
}

TEST_F(CaptureCommand, NamesLampsThatAreExchanged) {
    std::string toml = test::small_rig(6);
    toml.replace(toml.find("[sim]\n"), 6, "[sim]\nfaults = \"swapped-lamps@0:1,4\"\n");
    std::ofstream(rig_) << toml;
    const auto captured = capture({"--rig", rig_, "--out", vase_});
    EXPECT_EQ(captured.status, 0) << captured.err;
    const auto findings = nlohmann::json::parse(captured.out).at("findings");
    ASSERT_EQ(findings.size(), 1U);
    EXPECT_THAT(findings[0].get<std::string>(), HasSubstr("lamp-02 and lamp-05 are exchanged"));
    EXPECT_THAT(captured.err, HasSubstr("lamp-02 and lamp-05 are exchanged"));
    EXPECT_THAT(darkbox_program({"verify", vase_}).err, HasSubstr("2 frames were not verified"));
    // Once the wiring is right, what is in doubt is taken again without being named.
    std::ofstream(rig_) << test::small_rig(6);
    const auto again = capture({"--rig", rig_, "--retake", vase_, "--out", again_});
    ASSERT_EQ(again.status, 0) << again.err;
    EXPECT_TRUE(nlohmann::json::parse(again.out).at("findings").empty());
    EXPECT_THAT(darkbox_program({"verify", again_}).err, testing::Not(HasSubstr("not verified")));
}

TEST_F(CaptureCommand, TakesTheFlatFramesOfACardAlong) {
    const auto with = [&](const std::string& sim) {
        std::string toml = test::small_rig(6);
        toml.replace(toml.find("[sim]\nscene = \"brick-torus\""), 27,
                     "[sim]\nfaults = \"dim-lamp@0:2=0.7\"\nscene = " + sim);
        std::ofstream(rig_) << toml;
    };
    const fs::path card = folder_.path() / "card";
    with("\"card\"");
    const auto flat = capture({"--rig", rig_, "--plan", "flat", "--out", card});
    ASSERT_EQ(flat.status, 0) << flat.err;
    EXPECT_EQ(Session::open(card).frames()[1].kind, FrameKind::flat);
    with("\"brick-torus\"");
    const auto captured = capture({"--rig", rig_, "--flats-from", card, "--out", vase_});
    ASSERT_EQ(captured.status, 0) << captured.err;
    EXPECT_EQ(nlohmann::json::parse(captured.out).at("frames"), 16);
    const auto calibrated = darkbox_program({"calibrate", vase_, "--json"});
    ASSERT_EQ(calibrated.status, 0) << calibrated.err;
    const auto lights = nlohmann::json::parse(calibrated.out).at("lights");
    const double dim = lights.at(2).at("intensity").at(1), other = lights.at(0).at("intensity").at(1);
    EXPECT_NEAR(dim / other, 0.7, 0.02);
    const auto again = capture({"--rig", rig_, "--retake", vase_, "--lamps", "lamp-01", "--out", again_});
    EXPECT_EQ(again.status, 0) << again.err;
    EXPECT_THAT(darkbox_program({"verify", again_}).out,
                HasSubstr("7 of them taken over from vase, which is beside it as it was; "
                          "8 of a card taken over from card, which is beside it as it was"));
    EXPECT_THAT(capture({"--rig", rig_, "--plan", "flat", "--flats-from", card}).err, HasSubstr("at once"));
    EXPECT_THAT(darkbox_program({"process", card}).err, HasSubstr("--flats-from"));
    fs::remove(card / "data/session.json");
    std::ofstream(card / "data/session.json") << "{";
    const auto beside_damage = darkbox_program({"verify", vase_});
    EXPECT_EQ(beside_damage.status, 0) << beside_damage.err;
    EXPECT_THAT(beside_damage.err, HasSubstr("card is not the session that"));
}

TEST_F(CaptureCommand, FailsByNameOnADiskThatDoesAndGoesOn) {
    for (const std::string fault : {"failed-write", "full-disk"}) {
        std::string toml = test::small_rig(6);
        toml.replace(toml.find("[sim]\n"), 6, "[sim]\nfaults = \"" + fault + "@9\"\n");
        std::ofstream(rig_) << toml;
        const fs::path session = folder_.path() / fault;
        const auto failed = capture({"--rig", rig_, "--out", session});
        EXPECT_EQ(failed.status, 1);
        EXPECT_THAT(failed.err, HasSubstr("write " + session.string()));
        EXPECT_THAT(failed.err, HasSubstr("--resume " + session.string()));
        // The write that comes next time is another frame's: each try gets further, as on a disk that fails at times.
        int tries = 0;
        while (capture({"--resume", session}).status != 0 && ++tries < 4) continue;
        EXPECT_LT(tries, 4);
        const auto verified = darkbox_program({"verify", session});
        EXPECT_EQ(verified.status, 0) << verified.err;
    }
}

TEST_F(CaptureCommand, RefusesWhatMakesNoSense) {
    EXPECT_THAT(capture({"--rig", rig_, "--exposure", "bright"}).err, HasSubstr("neither auto nor microseconds"));
    EXPECT_THAT(capture({"--rig", rig_, "--retake", vase_, "--exposure", "auto"}).err,
                HasSubstr("keeps its session's"));
    EXPECT_NE(
        capture({"--rig", rig_, "--retake", folder_.path() / "none", "--lamps", "lamp-03", "--out", again_}).status, 0);
    EXPECT_FALSE(fs::exists(again_));
}

TEST_F(CaptureCommand, BracketsAndAveragesProcessAsOnePhotographALamp) {
    std::ofstream(rig_, std::ios::app) << "\n[capture]\naverages = 2\nbrackets = [1, 0.25]\ndark_every = 4\n";
    const auto captured = capture({"--rig", rig_, "--out", vase_});
    ASSERT_EQ(captured.status, 0) << captured.err;
    EXPECT_EQ(nlohmann::json::parse(captured.out).at("frames"), 2 * (12 + 2 + 2));
    const auto processed = darkbox_program({"process", vase_});
    ASSERT_EQ(processed.status, 0) << processed.err;
    std::ifstream lights(vase_ / "calibration/lights.lp");
    int count = 0;
    lights >> count;
    EXPECT_EQ(count, 6);
}

}  // namespace
}  // namespace darkbox
