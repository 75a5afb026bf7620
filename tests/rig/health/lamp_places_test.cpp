// Captures of the digital twin whose mirror ball tells that lamps are not where they should be.
#include <fmt/format.h>
#include <gmock/gmock.h>

#include <Eigen/Geometry>
#include <numbers>

#include "processing/pipeline/stages.h"
#include "rig/capture/capture_session.h"
#include "rig/health/frame_review.h"
#include "rig/health/known_lamps.h"
#include "sim/sim_rig.h"
#include "tests/support/test_data.h"

namespace darkbox {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

RigDescription dome(const std::string& faults = "") {
    RigDescription rig = parse_rig(simulated_rig_toml(8), "twin");
    rig.sim.width = 160;
    rig.sim.height = 120;
    rig.camera.mm_per_pixel = 1.25;
    rig.sim.faults = faults;
    return rig;
}

/// The same rig in larger pictures, whose ball tells angles twice as well, with one of its lamps turned, or all.
RigDescription turned(double degrees, std::optional<std::size_t> lamp) {
    RigDescription rig = parse_rig(simulated_rig_toml(8), "twin");
    const Eigen::AngleAxisd turn(degrees * std::numbers::pi / 180, Eigen::Vector3d::UnitX());
    for (std::size_t i = 0; i < rig.lamps.size(); ++i) {
        if (lamp && *lamp != i) continue;
        auto& place = rig.lamps[i].position_mm;
        const Eigen::Vector3d there = turn * Eigen::Vector3d(place[0], place[1], place[2]);
        place = {there.x(), there.y(), there.z()};
    }
    return rig;
}

class LampPlaces : public testing::Test {
protected:
    CapturedSession capture(const std::string& name, const RigDescription& rig, const std::string& object = "a cup",
                            std::optional<std::filesystem::path> retake = {}) {
        sim::SimRig sim = sim::SimRig::make(rig);
        CaptureRequest request{.folder = folder_.path() / name, .object = object, .lamps = {}};
        request.retake = std::move(retake);
        request.review = [&rig](const SessionWriter& session) { return review_frames(session, rig); };
        return capture_session(request, rig, sim.lamps(), sim.camera(), sim.clock());
    }

    static std::vector<std::string> doubted(const Session& session) {
        std::vector<std::string> lamps;
        for (const FrameRecord& record : session.frames())
            if (!record.verified) lamps.push_back(record.lamp_name);
        return lamps;
    }

    test::TemporaryFolder folder_;
};

TEST_F(LampPlaces, AreRightOnASoundRig) {
    const CapturedSession captured = capture("sound", dome());
    EXPECT_THAT(captured.findings, IsEmpty());
    EXPECT_THAT(doubted(captured.session), IsEmpty());
}

TEST_F(LampPlaces, ShowTwoLampsThatAreExchanged) {
    const CapturedSession captured = capture("swapped", dome("swapped-lamps@0:2,6"));
    ASSERT_EQ(captured.findings.size(), 1U);
    EXPECT_THAT(captured.findings.front(),
                HasSubstr("lamp-03 and lamp-07 are exchanged: each shines from where the other stands by rig.toml"));
    EXPECT_THAT(doubted(captured.session), ElementsAre("lamp-03", "lamp-07"));
    EXPECT_EQ(captured.session.events().back().what, captured.findings.front());
    captured.session.verify();
}

/// The other way round: a cable plugged in the wrong way.
TEST_F(LampPlaces, ShowThatAllAreExchanged) {
    const auto captured =
        capture("reversed", dome("swapped-lamps@0:0,7 swapped-lamps@0:1,6 swapped-lamps@0:2,5 swapped-lamps@0:3,4"));
    EXPECT_EQ(captured.findings.size(), 4U) << testing::PrintToString(captured.findings);
    EXPECT_EQ(doubted(captured.session).size(), 8U);
}

TEST_F(LampPlaces, ShowLampsExchangedInARing) {
    const auto captured = capture("ring", dome("swapped-lamps@0:1,3 swapped-lamps@0:3,5"));
    EXPECT_EQ(captured.findings.size(), 3U);
    EXPECT_THAT(captured.findings, testing::Each(HasSubstr("in a ring")));
    EXPECT_THAT(doubted(captured.session), ElementsAre("lamp-02", "lamp-04", "lamp-06"));
}

TEST_F(LampPlaces, AreTakenAgainOnceTheWiringIsRight) {
    (void)capture("swapped", dome("swapped-lamps@0:2,6"));
    const auto again = capture("again", dome(), "", folder_.path() / "swapped");
    EXPECT_THAT(again.findings, IsEmpty());
    EXPECT_THAT(doubted(again.session), IsEmpty());
    EXPECT_EQ(again.summary.taken, 4) << "two lamps, and a dark frame before and after";
}

TEST_F(LampPlaces, AreComparedWithTheLatestCalibration) {
    run_calibrate(capture("first", dome()).session);
    const auto captured = capture("second", dome("swapped-lamps@0:0,4"));
    ASSERT_EQ(captured.findings.size(), 1U);
    EXPECT_THAT(captured.findings.front(), HasSubstr("stands by the calibration of first"));
    EXPECT_THAT(doubted(captured.session), ElementsAre("lamp-01", "lamp-05"));
    // What is in doubt is no reference, however new.
    run_calibrate(captured.session);
    EXPECT_EQ(calibrated_lamps(folder_.path(), dome(), "third")->source, "the calibration of first");
}

TEST_F(LampPlaces, TellHowFarALampMoved) {
    run_calibrate(capture("first", turned(0, 3)).session);
    const auto captured = capture("second", turned(9, 3));
    ASSERT_EQ(captured.findings.size(), 1U);
    const auto known = calibrated_lamps(folder_.path(), turned(0, 3), "second");
    const Eigen::Vector3d before = known->lights.lights[3].direction;
    const auto& place = turned(9, 3).lamps[3].position_mm;
    const double moved = angle_deg(before, Eigen::Vector3d(place[0], place[1], place[2]).normalized());
    const std::string& words = captured.findings.front();
    ASSERT_THAT(words, HasSubstr("lamp-04 moved: it shines from "));
    EXPECT_NEAR(std::stod(words.substr(words.find("from ") + 5)), moved, 1.0) << words;
    EXPECT_THAT(doubted(captured.session), IsEmpty()) << "its frame is its own all the same";
}

TEST_F(LampPlaces, TellACameraThatWasKnocked) {
    run_calibrate(capture("first", turned(0, 3)).session);
    const auto captured = capture("second", turned(6, std::nullopt));
    ASSERT_EQ(captured.findings.size(), 1U);
    EXPECT_THAT(captured.findings.front(), HasSubstr("all lamps shine from 6."));
    EXPECT_THAT(doubted(captured.session), IsEmpty());
}

TEST_F(LampPlaces, OfARecalibrationAreToldAndNotDoubted) {
    const auto captured = capture("ball", dome("swapped-lamps@0:2,6"), recalibration_object);
    EXPECT_EQ(captured.findings.size(), 1U);
    EXPECT_THAT(doubted(captured.session), IsEmpty());
}

/// Near lamps are seen from the ball, and not from the object, by a camera that sees it aslant.
TEST_F(LampPlaces, OfNearLampsAreThoseSeenFromTheBall) {
    std::string toml = simulated_rig_toml(8);
    toml.replace(toml.find("brick-torus"), 11, "brick-torus-near-perspective");
    for (const auto& [faults, findings] : {std::pair{"", 0U}, std::pair{"swapped-lamps@0:1,7", 1U}}) {
        RigDescription rig = parse_rig(toml, "twin");
        rig.sim.faults = faults;
        const auto captured = capture(fmt::format("near-{}", findings), rig);
        EXPECT_EQ(captured.findings.size(), findings) << testing::PrintToString(captured.findings);
    }
}

/// From the frame on that belongs to the fourth lamp something is not where it was.
TEST_F(LampPlaces, AndMovementAreTold) {
    for (const auto& [fault, who] :
         {std::pair{"camera-knock", "the camera moved by "}, std::pair{"object-knock", "the object moved by "}}) {
        RigDescription rig = dome();
        rig.capture.closing_repeat = true;
        const Session still = capture(std::string("still-") + fault, rig).session;
        rig.sim.faults = fmt::format("{}@{}=0.8", fault, still.frames()[4].sequence - 1);
        const auto captured = capture(fault, rig);
        ASSERT_EQ(captured.findings.size(), 1U) << fault;
        const std::string& words = captured.findings.front();
        ASSERT_THAT(words, testing::StartsWith(who));
        EXPECT_NEAR(std::stod(words.substr(std::string(who).size())), 0.8, 0.05) << words;
        EXPECT_THAT(words, HasSubstr("between the first and the last frame of lamp-01"));
        EXPECT_THAT(doubted(captured.session), IsEmpty());
    }
}

/// A matte ball, lit from all around, has no lamp's image anywhere.
TEST(LampPlacesWithoutABall, AreNotTold) {
    const RigDescription rig = dome();
    std::vector<LampPicture> pictures;
    for (const Light& lamp : described_lamps(rig).lights.lights) {
        cv::Mat1f light(120, 160, 0.02F);
        for (int v = 0; v < light.rows; ++v)
            for (int u = 0; u < light.cols; ++u) {
                const Eigen::Vector2d at((u - 70) / 30.0, -(v - 60) / 30.0);
                if (at.norm() >= 1) continue;
                const Eigen::Vector3d normal(at.x(), at.y(), std::sqrt(1 - at.squaredNorm()));
                light(v, u) = static_cast<float>(0.02 + 0.7 * std::max(0.0, normal.dot(lamp.direction)));
            }
        pictures.push_back({lamp.file, light});
    }
    EXPECT_FALSE(places_on_ball(pictures, rig));
    pictures.resize(2);
    EXPECT_FALSE(places_on_ball(pictures, rig)) << "two frames do not tell a ball";
}

}  // namespace
}  // namespace darkbox
