#include "rig/health/warm_up.h"

#include <gmock/gmock.h>

#include <cmath>

#include "acquisition/frame/error.h"
#include "rig/daemon/readiness.h"
#include "sim/sim_rig.h"

namespace darkbox {
namespace {

using testing::HasSubstr;

RigDescription cold_twin(const std::string& faults) {
    RigDescription rig = parse_rig(simulated_rig_toml(4), "twin");
    rig.sim.width = 80;
    rig.sim.height = 60;
    rig.sim.faults = faults;
    return rig;
}

WarmUp watched(const RigDescription& rig, const WarmUpOptions& options = {}) {
    sim::SimRig sim = sim::SimRig::make(rig);
    const WarmUp found = watch_warm_up(rig, {sim.lamps(), sim.camera(), sim.clock()}, options);
    for (const sim::ExposureTruth& exposure : sim.camera().exposures()) EXPECT_TRUE(exposure.lamps.empty());
    EXPECT_TRUE(sim.lamps().all_dark());
    return found;
}

TEST(WarmUp, FindsAWarmCameraSteadyAtOnce) {
    const WarmUp found = watched(cold_twin(""));
    EXPECT_TRUE(found.steady);
    EXPECT_LT(std::abs(found.per_minute), 1e-4);
    EXPECT_LT(found.watched, Seconds(12));
}

TEST(WarmUp, WaitsUntilAColdOneIsWarm) {
    // What is off by a at first halves every 30 s: it changes by 1.386 a a minute at first, and slowly enough from
    // `slow` on. A window of 10 s is steady some time after its middle came there, and before its beginning did; the
    // next look comes a second later at most.
    for (const double amount : {0.004, 0.02}) {
        const WarmUp found = watched(cold_twin("warming@0=" + std::to_string(amount)));
        EXPECT_TRUE(found.steady);
        EXPECT_LT(found.per_minute, 0);
        const double slow = 30 * std::log2(2 * std::log(2.0) * amount / 0.0005);
        EXPECT_GE(found.watched.count(), slow + 5) << amount;
        EXPECT_LE(found.watched.count(), slow + 10 + 1.5) << amount;
    }
}

TEST(WarmUp, GivesUpInTheEnd) {
    WarmUpOptions options;
    options.longest = Seconds(30);
    const WarmUp found = watched(cold_twin("warming@0=0.02"), options);
    EXPECT_FALSE(found.steady);
    EXPECT_NEAR(found.watched.count(), 30, 2);
    EXPECT_NEAR(found.per_minute, -2 * std::log(2.0) * 0.02 * std::exp2(-25.0 / 30), 0.001);
    EXPECT_THAT(found.words(), HasSubstr("after 30 s"));
}

TEST(WarmUp, HasLimitsItself) {
    WarmUpOptions options;
    options.steady_level = 0;
    EXPECT_THROW(options.validate(), InputError);
    options = {};
    options.longest = Seconds(1);
    EXPECT_THROW(options.validate(), InputError);
}

// What [health] makes of it.

class ReadinessTest : public testing::Test {
protected:
    /// What keeps a capture from beginning; the notes of one that may.
    std::string required(const RigDescription& rig) {
        sim::SimRig sim = sim::SimRig::make(rig);
        const CaptureDevices devices{sim.lamps(), sim.camera(), sim.clock()};
        Readiness readiness(rig.health);
        request_ = {};
        try {
            readiness.require(rig, devices, request_, {});
            readiness.used(sim.clock().now());
            const auto noted = request_.notes.size();
            readiness.require(rig, devices, request_, {});  // a moment later
            EXPECT_EQ(request_.notes.size(), noted) << "it is warm still";
        } catch (const InputError& error) {
            EXPECT_STRNE(error.hint().c_str(), "");
            return error.what();
        }
        return request_.notes.empty() ? "" : request_.notes.front();
    }

    CaptureRequest request_;
};

TEST_F(ReadinessTest, TreatsAColdCameraAsTheRuleSays) {
    RigDescription rig = cold_twin("warming@0=0.02");
    EXPECT_EQ(required(rig), "");
    rig.health.warm_up = WarmUpRule::warn;
    EXPECT_THAT(required(rig), HasSubstr("not warm yet"));
    EXPECT_FALSE(request_.notes.empty());
    rig.health.warm_up = WarmUpRule::refuse;
    EXPECT_THAT(required(rig), HasSubstr("not warm yet"));
    EXPECT_TRUE(request_.notes.empty());
    rig.health.warm_up = WarmUpRule::wait;
    EXPECT_THAT(required(rig), HasSubstr("the camera is warm"));
    rig.health.warm_up_longest = Seconds(30);
    EXPECT_THAT(required(rig), HasSubstr("does not get steady"));
}

TEST_F(ReadinessTest, LeavesHotLampsAlone) {
    RigDescription rig = cold_twin("hot-lamps@0=75");
    EXPECT_EQ(required(rig), "");
    rig.health.hottest_c = 60;
    EXPECT_THAT(required(rig), HasSubstr("75 degrees Celsius; no capture begins above 60"));
    rig.health.hottest_c = 80;
    EXPECT_EQ(required(rig), "");
}

}  // namespace
}  // namespace darkbox
