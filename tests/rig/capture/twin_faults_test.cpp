#include <fmt/format.h>
#include <gmock/gmock.h>

#include "acquisition/device/device_error.h"
#include "rig/capture/capture_session.h"
#include "rig/capture/interlock.h"
#include "sim/sim_rig.h"
#include "tests/support/test_data.h"

namespace darkbox {
namespace {

using testing::AllOf;
using testing::HasSubstr;

/// Six lamps around a small picture; `faults` as rig.toml names them.
RigDescription twin(const std::string& faults) {
    std::string toml = simulated_rig_toml(6);
    toml.replace(toml.find("[sim]\n"), 6, "[sim]\nfaults = \"" + faults + "\"\n");
    RigDescription rig = parse_rig(toml, "twin");
    rig.sim.width = 96;
    rig.sim.height = 72;
    return rig;
}

struct Captured {
    std::optional<Session> session;
    std::string error;
    std::string remedy;
    int repeated = 0;
    std::string events;
    /// For each frame kept, the lamps that really lit it.
    std::vector<std::vector<sim::LampShare>> truth;
};

std::vector<sim::LampShare> truth_of(const sim::SimCamera& camera, const FrameRecord& record) {
    for (const sim::ExposureTruth& e : camera.exposures())
        if (e.timestamp.time_since_epoch().count() == record.timestamp_ns) return e.lamps;
    return {};
}

class TwinFaults : public testing::Test {
protected:
    Captured capture(const std::string& faults, CaptureStart start = CaptureStart::create) {
        const RigDescription rig = twin(faults);
        sim::SimRig sim = sim::SimRig::make(rig);
        InterlockedLamps lamps(sim.lamps(), sim.door());
        InterlockedCamera camera(sim.camera(), lamps);
        Captured result;
        try {
            auto captured =
                capture_session({folder_.path() / "session", "a cup", {}, start}, rig, lamps, camera, sim.clock());
            result.repeated = captured.summary.repeated;
            for (const SessionEvent& event : captured.session.events()) result.events += event.what + "\n";
            for (const FrameRecord& record : captured.session.frames())
                result.truth.push_back(truth_of(sim.camera(), record));
            result.session = std::move(captured.session);
        } catch (const Error& error) {
            result.error = error.what();
            result.remedy = error.hint();
            EXPECT_FALSE(result.remedy.empty()) << error.what();
        }
        return result;
    }

    /// Sealed and verified, and the twin itself says that every frame was lit by its lamp alone.
    static void expect_right(const Captured& captured) {
        ASSERT_TRUE(captured.session) << captured.error;
        captured.session->verify();
        const auto& frames = captured.session->frames();
        ASSERT_EQ(frames.size(), 8U);
        for (std::size_t i = 0; i < frames.size(); ++i) {
            EXPECT_TRUE(frames[i].verified) << frames[i].file;
            ASSERT_EQ(captured.truth[i].size(), frames[i].lamp ? 1U : 0U) << frames[i].file;
            if (!frames[i].lamp) continue;
            EXPECT_EQ(captured.truth[i][0].lamp, *frames[i].lamp) << frames[i].file;
            EXPECT_NEAR(captured.truth[i][0].share, 1, 1e-6) << frames[i].file;
        }
    }

    test::TemporaryFolder folder_;
};

/// A camera's fault at frames all over a capture.
class OfTheCamera : public TwinFaults, public testing::WithParamInterface<const char*> {};

TEST_P(OfTheCamera, AreRepairedWheneverTheyHappen) {
    for (int at = 0; at < 24; at += 3) {
        std::filesystem::remove_all(folder_.path() / "session");
        SCOPED_TRACE(at);
        expect_right(capture(fmt::format("{}@{}", GetParam(), at)));
    }
}

INSTANTIATE_TEST_SUITE_P(Each, OfTheCamera,
                         testing::Values("drop", "error-flag", "repeat", "stale-queue", "black-frame", "hang", "unplug",
                                         "sequence-wrap"));

TEST_F(TwinFaults, UnpluggedCamerasAreWaitedForAsOftenAsShotsAreTried) {
    expect_right(capture("unplug@9x2"));
    std::filesystem::remove_all(folder_.path() / "session");
    const Captured lost = capture("unplug@9x9");
    EXPECT_THAT(lost.error,
                AllOf(HasSubstr("no good frame in 3 tries"), HasSubstr("the simulated camera was unplugged")));
    EXPECT_TRUE(std::filesystem::exists(folder_.path() / "session" / "journal.jsonl"));
}

TEST_F(TwinFaults, AHangForEverNamesLampAndFrame) {
    EXPECT_THAT(capture("hang@5x100000").error, AllOf(HasSubstr("no good frame in 3 tries"), HasSubstr("frame 000")));
}

TEST_F(TwinFaults, ADeadLampIsNamed) {
    EXPECT_THAT(capture("dead-lamp@0:3").error,
                AllOf(HasSubstr("lamp 'lamp-04'"), HasSubstr("as dark as the dark frame")));
}

/// From the start the first dark frame is bright; later the closing one is, or the next lamp's picture holds two.
TEST_F(TwinFaults, AStuckLampIsFound) {
    for (const int from : {0, 3, 5}) {
        std::filesystem::remove_all(folder_.path() / "session");
        EXPECT_FALSE(capture(fmt::format("stuck-lamp@{}:2", from)).session) << from;
    }
    std::filesystem::remove_all(folder_.path() / "session");
    EXPECT_THAT(capture("stuck-lamp@0:2").error, HasSubstr("the dark frame is bright"));
}

TEST_F(TwinFaults, AnOpenDoorLeavesASessionThatCanBeResumed) {
    const Captured open = capture("door-open@9");
    EXPECT_EQ(open.error, "the door of the box is open");
    EXPECT_THAT(open.remedy, HasSubstr("resume"));
    EXPECT_TRUE(std::filesystem::exists(folder_.path() / "session" / "journal.jsonl"));
}

TEST_F(TwinFaults, UnknownOnesAreRefusedBeforeAnythingBegins) {
    const RigDescription rig = twin("melt@3");
    EXPECT_THROW(sim::SimRig::make(rig), InputError);
}

}  // namespace
}  // namespace darkbox
