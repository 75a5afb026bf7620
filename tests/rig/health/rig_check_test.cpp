#include "rig/health/rig_check.h"

#include <gtest/gtest.h>

#include <cmath>

#include "acquisition/frame/error.h"
#include "rig/health/linearity.h"
#include "sim/sim_rig.h"

namespace darkbox {
namespace {

/// The built-in rig of eight lamps; a fault of known size goes wrong in it.
RigDescription twin(const std::string& faults, double exposure_ms = 20, int width = 160) {
    RigDescription rig = parse_rig(simulated_rig_toml(8), "twin");
    rig.sim.width = width;
    rig.sim.height = width * 3 / 4;
    rig.sim.faults = faults;
    rig.camera.exposure = Seconds(exposure_ms / 1000);
    return rig;
}

struct Checked {
    RigReport report;
    std::vector<sim::ExposureTruth> exposures;
};

Checked checked(const RigDescription& rig) {
    sim::SimRig sim = sim::SimRig::make(rig);
    Checked result;
    result.report = check_rig(rig, {sim.lamps(), sim.camera(), sim.clock()}, {});
    result.exposures = sim.camera().exposures();
    EXPECT_TRUE(sim.lamps().all_dark());
    return result;
}

std::vector<RigFinding> all_of(const RigReport& report, const std::string& what) {
    std::vector<RigFinding> found;
    for (const RigFinding& finding : report.findings)
        if (finding.what == what) found.push_back(finding);
    return found;
}

/// The only finding of its kind.
RigFinding one_of(const RigReport& report, const std::string& what) {
    const auto found = all_of(report, what);
    EXPECT_EQ(found.size(), 1U) << what;
    return found.empty() ? RigFinding{} : found.front();
}

/// The twin's own failures, but for the named kind.
void expect_only(const RigReport& report, const std::string& what) {
    EXPECT_FALSE(report.good());
    for (const RigFinding& finding : report.findings)
        if (finding.verdict == RigVerdict::failed) {
            EXPECT_EQ(finding.what, what) << finding.words;
        }
}

TEST(RigCheck, FindsNothingOnASoundRig) {
    const RigReport report = checked(twin("")).report;
    for (const RigFinding& finding : report.findings)
        EXPECT_EQ(finding.verdict, RigVerdict::good) << finding.what << " " << finding.where << ": " << finding.words;
    EXPECT_TRUE(report.failures().empty());
    EXPECT_LT(*one_of(report, "linearity").value, 0.2);
    EXPECT_EQ(all_of(report, "flicker").size(), 8U);
    EXPECT_EQ(all_of(report, "lamp").size(), 8U);
}

/// What the sweep must give for x + 4 amount x (1 - x) when its longest exposure fills `top` of the well.
double bend_percent(double amount, double top) {
    std::vector<ExposedSignal> points;
    for (const double share : {1.0 / 16, 1.0 / 8, 0.25, 0.375, 0.5, 0.625, 0.75, 0.875, 1.0}) {
        const double x = share * top;
        points.push_back({Seconds(share), x + 4 * amount * x * (1 - x)});
    }
    return 100 * measure_linearity(points).deviation;
}

TEST(RigCheck, MeasuresHowFarASensorBends) {
    for (const double amount : {0.02, 0.05}) {
        const RigReport report = checked(twin("nonlinear@0=" + std::to_string(amount))).report;
        const RigFinding found = one_of(report, "linearity");
        EXPECT_EQ(found.verdict, RigVerdict::failed);
        EXPECT_NEAR(*found.value, bend_percent(amount, 0.86), 10 * amount) << found.words;
    }
}

/// Pulses of 1000 a second over an exposure of 20.3 ms: what the frames of each lamp really had is the twin's to tell.
TEST(RigCheck, MeasuresThePulsesOfALamp) {
    const Checked result = checked(twin("pwm@0=1000", 20.3));
    const auto found = all_of(result.report, "flicker");
    ASSERT_EQ(found.size(), 8U);
    for (std::size_t lamp = 0; lamp < 8; ++lamp) {
        std::vector<double> shares;  // of its first frames: later ones have other exposures
        for (const sim::ExposureTruth& e : result.exposures)
            if (e.lamps.size() == 1 && e.lamps[0].lamp.value == lamp && e.lamps[0].share > 0.9 && shares.size() < 16)
                shares.push_back(e.lamps[0].share);
        ASSERT_EQ(shares.size(), 16U);
        double least = 2, most = 0;
        for (const double share : shares) least = std::min(least, share), most = std::max(most, share);
        EXPECT_EQ(found[lamp].verdict, RigVerdict::failed) << *found[lamp].value;
        EXPECT_GT(*found[lamp].value, 100 * (most - least) / 6);
        EXPECT_LT(*found[lamp].value, 100 * (most - least) / 1.9);
    }
}

TEST(RigCheck, AcceptsWholePulses) {
    for (const RigFinding& finding : all_of(checked(twin("pwm@0=1000")).report, "flicker"))
        EXPECT_EQ(finding.verdict, RigVerdict::good) << *finding.value;
}

TEST(RigCheck, FindsALeakingLampAndHowMuch) {
    for (const double amount : {0.01, 0.03}) {
        const RigReport report = checked(twin("leaking-lamp@0:2,6=" + std::to_string(amount), 20, 320)).report;
        expect_only(report, "leak");
        const RigFinding found = one_of(report, "leak");
        EXPECT_EQ(found.where, "lamp-07");
        EXPECT_NE(found.words.find("lamp-03"), std::string::npos) << found.words;
        EXPECT_NEAR(*found.value, 100 * amount, 20 * amount);
    }
}

TEST(RigCheck, FindsADimLampAndHowMuch) {
    const RigReport report = checked(twin("dim-lamp@0:3=0.5")).report;
    expect_only(report, "lamp");
    for (const RigFinding& finding : all_of(report, "lamp")) {
        EXPECT_EQ(finding.verdict == RigVerdict::failed, finding.where == "lamp-04") << finding.words;
        if (finding.where == "lamp-04") {
            EXPECT_NEAR(*finding.value, 50, 5);
        }
    }
}

TEST(RigCheck, FindsADeadLamp) {
    const RigReport report = checked(twin("dead-lamp@0:4")).report;
    expect_only(report, "lamp");
    ASSERT_EQ(report.failures().size(), 1U);
    EXPECT_NE(report.failures().front().find("lamp-05: it is dead"), std::string::npos) << report.failures().front();
}

/// To a third of a pixel and a fifth of the blur, on an object with edges.
TEST(RigCheck, FindsALensOutOfFocus) {
    const RigFinding sharp = one_of(checked(twin("")).report, "focus");
    EXPECT_EQ(sharp.verdict, RigVerdict::good);
    EXPECT_LT(*sharp.value, 0.6);
    const RigFinding nearly = one_of(checked(twin("defocus@0=1")).report, "focus");
    EXPECT_EQ(nearly.verdict, RigVerdict::good);
    EXPECT_NEAR(*nearly.value, 1, 0.35);
    for (const int sigma : {2, 3}) {
        const RigFinding soft = one_of(checked(twin("defocus@0=" + std::to_string(sigma))).report, "focus");
        EXPECT_EQ(soft.verdict, RigVerdict::failed);
        EXPECT_NEAR(*soft.value, sigma, 0.35 + 0.2 * sigma);
    }
}

/// A knock in the midst of it, from the frame on that is a third of all.
TEST(RigCheck, MeasuresWhatMoved) {
    const auto frames = checked(twin("")).exposures;
    const std::string at = std::to_string(frames[frames.size() / 3].sequence);
    for (const double amount : {0.5, 2.0}) {
        const RigFinding camera =
            one_of(checked(twin("camera-knock@" + at + "=" + std::to_string(amount))).report, "movement");
        EXPECT_EQ(camera.verdict, RigVerdict::failed);
        EXPECT_NEAR(*camera.value, amount, 0.05) << camera.words;
        EXPECT_NE(camera.words.find("the camera moved"), std::string::npos) << camera.words;
        const RigFinding object =
            one_of(checked(twin("object-knock@" + at + "=" + std::to_string(amount))).report, "movement");
        EXPECT_EQ(object.verdict, RigVerdict::failed);
        EXPECT_NEAR(*object.value, amount, 0.05) << object.words;
        EXPECT_NE(object.words.find("the object moved"), std::string::npos) << object.words;
    }
}

TEST(RigCheck, LetsASmallMovementPass) {
    const RigFinding found = one_of(checked(twin("camera-knock@200=0.15")).report, "movement");
    EXPECT_EQ(found.verdict, RigVerdict::good);
    EXPECT_NEAR(*found.value, 0.15, 0.05);
    EXPECT_LT(*one_of(checked(twin("")).report, "movement").value, 0.03);
}

TEST(RigCheck, FindsClipping) {
    const RigReport report = checked(twin("", 60)).report;
    const RigFinding found = one_of(report, "clipping");
    EXPECT_EQ(found.verdict, RigVerdict::failed);
    EXPECT_GT(*found.value, 1);
}

TEST(RigCheck, RefusesUnreasonableOptions) {
    const RigDescription rig = twin("");
    sim::SimRig sim = sim::SimRig::make(rig);
    EXPECT_THROW(check_rig(rig, {sim.lamps(), sim.camera(), sim.clock()}, {.frames = 2}), InputError);
    EXPECT_THROW(check_rig(rig, {sim.lamps(), sim.camera(), sim.clock()}, {.most_leak = 0}), InputError);
}

}  // namespace
}  // namespace darkbox
