#include "processing/calibration/rig_plan.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>

#include "tests/support/throws.h"

namespace darkbox {
namespace {

using testing::HasSubstr;
using testing::SizeIs;

RigPlanOptions lamps(int count, PlanShadows shadows = PlanShadows::automatic) {
    RigPlanOptions options;
    options.lamps = count;
    options.shadows = shadows;
    return options;
}

double elevation_deg(const Eigen::Vector3d& position) {
    return std::asin(position.z() / position.norm()) * 180 / std::numbers::pi;
}

TEST(RigPlan, ThreeLampsStandAsAnOrthogonalTriad) {
    const RigPlan plan = plan_rig(lamps(3));
    ASSERT_THAT(plan.positions_mm, SizeIs(3));
    EXPECT_EQ(plan.shadows, PlanShadows::ignored);
    for (std::size_t i = 0; i < 3; ++i) {
        EXPECT_NEAR(90 - elevation_deg(plan.positions_mm[i]), 54.7356, 0.3);
        EXPECT_NEAR(angle_deg(plan.positions_mm[i], plan.positions_mm[(i + 1) % 3]), 90, 0.5);
    }
    // The theory's least: the noise over every axis of g, two of which are across it.
    EXPECT_NEAR(plan.predicted_error_deg, 0.01 * std::sqrt(2.0) * 180 / std::numbers::pi, 1e-4);
}

TEST(RigPlan, WithoutShadowsEveryCountReachesTheTheorysLeast) {
    for (const int count : {4, 6, 12}) {
        const double least = 0.01 * std::sqrt(2 * 3.0 / count) * 180 / std::numbers::pi;
        EXPECT_NEAR(plan_rig(lamps(count, PlanShadows::ignored)).predicted_error_deg, least, 0.003 * least) << count;
    }
}

TEST(RigPlan, LimitsThatForbidTheTriadAreKept) {
    RigPlanOptions options = lamps(3);
    options.min_elevation_deg = 50;
    for (const Eigen::Vector3d& position : plan_rig(options).positions_mm)
        EXPECT_NEAR(elevation_deg(position), 50, 0.3);  // as near to the triad as allowed
}

TEST(RigPlan, ErrorFallsWithTheNumberOfLampsAndBeatsTheRing) {
    double last = std::numeric_limits<double>::infinity();
    for (const int count : {3, 4, 5, 6, 8, 12, 24, 64}) {
        const RigPlan plan = plan_rig(lamps(count, PlanShadows::respected));
        EXPECT_LT(plan.predicted_error_deg, last) << count;
        EXPECT_LT(plan.predicted_error_deg, 0.95 * plan.ring_error_deg) << count;
        last = plan.predicted_error_deg;
    }
}

TEST(RigPlan, DistanceElevationAndSeparationAreRespected) {
    RigPlanOptions options = lamps(16);
    options.distance_mm = 600;
    options.min_elevation_deg = 30;
    options.max_elevation_deg = 70;
    options.min_separation_deg = 18;
    const RigPlan plan = plan_rig(options);
    ASSERT_THAT(plan.positions_mm, SizeIs(16));
    for (std::size_t i = 0; i < 16; ++i) {
        EXPECT_NEAR(plan.positions_mm[i].norm(), 600, 1e-9);
        EXPECT_GE(elevation_deg(plan.positions_mm[i]), 30 - 1e-9);
        EXPECT_LE(elevation_deg(plan.positions_mm[i]), 70 + 1e-9);
        for (std::size_t j = 0; j < i; ++j) EXPECT_GE(angle_deg(plan.positions_mm[i], plan.positions_mm[j]), 18 - 1e-9);
    }
}

TEST(RigPlan, IsTheSameEachTimeAndOnAnyNumberOfThreads) {
    WorkContext one, four;
    one.threads = 1;
    four.threads = 4;
    const RigPlan a = plan_rig(lamps(9), one), b = plan_rig(lamps(9), four);
    EXPECT_EQ(a.positions_mm, b.positions_mm);
    EXPECT_EQ(a.predicted_error_deg, b.predicted_error_deg);
}

TEST(RigPlan, WhatCannotBeIsAnErrorInWords) {
    EXPECT_THAT(test::input_error_of([] { plan_rig(lamps(2)); }), HasSubstr("lamps is 2"));
    EXPECT_THAT(test::input_error_of([] { plan_rig(lamps(65)); }), HasSubstr("lamps is 65"));
    RigPlanOptions upside_down = lamps(9);
    upside_down.max_elevation_deg = 10;
    EXPECT_THAT(test::input_error_of([&] { plan_rig(upside_down); }), HasSubstr("max_elevation_deg"));
    RigPlanOptions crowded = lamps(64);
    crowded.min_separation_deg = 40;
    EXPECT_THAT(test::input_error_of([&] { plan_rig(crowded); }), HasSubstr("do not fit"));
}

}  // namespace
}  // namespace darkbox
