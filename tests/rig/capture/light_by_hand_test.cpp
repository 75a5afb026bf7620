#include "rig/capture/light_by_hand.h"

#include <gmock/gmock.h>

#include <cmath>

#include "rig/capture/dose_book.h"
#include "rig/capture/light_dose.h"
#include "tests/rig/capture/bench.h"

namespace darkbox {
namespace {

using test::Bench;
using testing::HasSubstr;

class LightByHand : public testing::Test {
protected:
    LightByHand() {
        for (LampDescription& lamp : bench_.rig.lamps) lamp.dose_per_s = {1000, 0, 0};
    }
    void shine_for(double seconds, const std::string& object) {
        WorkContext work;
        work.stop = bench_.stop.get_token();
        shine(light_by_hand(bench_.rig, "lamp-02", Seconds(seconds), object), bench_.rig, bench_.lamps, bench_.clock,
              bench_.folder.path(), work, look_);
    }
    double booked(const std::string& whose) const { return DoseBook(bench_.folder.path()).spent(whose).lux_s; }
    double lit_s() const {
        const Interval all{TimePoint{}, bench_.clock.now() + std::chrono::seconds(1)};
        return bench_.lamps.shares(all).at(1) * to_seconds(all.end - all.begin);
    }

    Bench bench_;
    std::function<void()> look_ = [] {};
};

TEST_F(LightByHand, CountsAsTheObjectsLight) {
    shine_for(0.5, "vase");
    EXPECT_NEAR(lit_s(), 0.5, 0.001);
    EXPECT_NEAR(booked("vase"), 500, 1);
    EXPECT_EQ(booked(account_of(bench_.rig)), 0);
    EXPECT_TRUE(bench_.lamps.is_dark());
}

TEST_F(LightByHand, IsTheRigsWhereNobodySaysWhatLiesThere) {
    bench_.rig.dose.object_lux_s = 100;
    shine_for(0.5, "");
    EXPECT_NEAR(booked("rig simulated-4"), 500, 1);
    EXPECT_EQ(booked(""), 0);
}

TEST_F(LightByHand, IsRefusedAsAWholeWhereTheBudgetDoesNotBearAllOfIt) {
    bench_.rig.dose.object_lux_s = 700;
    shine_for(0.5, "vase");
    try {
        shine_for(0.3, "vase");
        FAIL();
    } catch (const DoseExceeded& error) {
        EXPECT_THAT(error.what(), HasSubstr("'vase' has had 500 of 700 lux seconds"));
    }
    EXPECT_NEAR(lit_s(), 0.5, 0.001) << "nothing is lit for as long as the budget lasts";
    EXPECT_NEAR(booked("vase"), 500, 1);
}

TEST_F(LightByHand, EndsWhenItIsCancelledAndCountsWhatThereWas) {
    int looks = 0;
    bench_.clock.hook = [&](const std::string&) {
        if (!bench_.lamps.is_dark() && ++looks == 20) bench_.stop.request_stop();
    };
    shine_for(1.5, "vase");
    bench_.clock.hook = {};
    EXPECT_TRUE(bench_.lamps.is_dark());
    EXPECT_LT(lit_s(), 0.5);
    EXPECT_GT(lit_s(), 0.01);
    EXPECT_NEAR(booked("vase"), 1000 * lit_s(), 1);
    EXPECT_THROW(shine_for(1.5, "cup"), Cancelled) << "what is cancelled before it begins was not lit";
    EXPECT_EQ(booked("cup"), 0);
}

TEST_F(LightByHand, EndsWithWhatALookThrowsAndCountsWhatThereWas) {
    look_ = [looks = 0]() mutable {
        if (++looks == 5) throw DoseExceeded("seen", "");
    };
    EXPECT_THROW(shine_for(1.5, "vase"), DoseExceeded);
    EXPECT_TRUE(bench_.lamps.is_dark());
    EXPECT_NEAR(lit_s(), 0.1, 0.01) << "a look every 20 ms";
    EXPECT_NEAR(booked("vase"), 1000 * lit_s(), 1);
}

TEST_F(LightByHand, WantsALampAndATimeThatThereAre) {
    const RigDescription& rig = bench_.rig;
    const double most = 0.9 * rig.lamps[1].max_on.count();
    EXPECT_NEAR(light_by_hand(rig, "lamp-02", std::nullopt, "").time.count(), most, 1e-9);
    EXPECT_EQ(light_by_hand(rig, "lamp-02", std::nullopt, "").lamp, LampId{1});
    EXPECT_THROW(light_by_hand(rig, "lamp-99", std::nullopt, ""), InputError);
    for (const double seconds : {0.0, -1.0, 1.01 * most, std::nan("")})
        EXPECT_THROW(light_by_hand(rig, "lamp-02", Seconds(seconds), ""), InputError) << seconds;
}

}  // namespace
}  // namespace darkbox
