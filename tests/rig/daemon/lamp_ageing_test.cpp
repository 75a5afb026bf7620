#include "rig/daemon/lamp_ageing.h"

#include <gmock/gmock.h>

#include <random>

namespace darkbox {
namespace {

using testing::HasSubstr;

/// 200 weekly runs of 16 lamps. Lamp k loses 0.03 k % of its first light a month, every reading is off by 1 %, the
/// camera's gain by 20 % from run to run, and every 23rd run has a hand before one lamp.
std::vector<DatedLights> simulated_history(double hand) {
    std::mt19937 random(5);
    std::normal_distribution<double> normal;
    std::vector<DatedLights> history;
    for (int run = 0; run < 200; ++run) {
        DatedLights dated{.day = 7.0 * run, .calibration = {}};
        dated.calibration.intensities_known = true;
        const double gain = 1 + 0.2 * normal(random);
        for (int k = 0; k < 16; ++k) {
            const double months = dated.day / (365.25 / 12);
            double light = (1 + 0.03 * k) * (1 - 0.0003 * k * months) * gain * (1 + 0.01 * normal(random));
            if (run % 23 == 5 && k == run % 16) light *= hand;
            Light one;
            one.intensity.setConstant(light);
            dated.calibration.lights.push_back(one);
            dated.calibration.rig.lamps.push_back("lamp-" + std::to_string(k));
        }
        history.push_back(std::move(dated));
    }
    return history;
}

TEST(LampAgeing, IsFoundInAHistoryOf200Runs) {
    for (const double hand : {1.0, 0.3}) {
        const auto lamps = lamp_ageing(simulated_history(hand));
        ASSERT_EQ(lamps.size(), 16u);
        for (int k = 0; k < 16; ++k) {
            const LampAgeing& lamp = lamps[static_cast<std::size_t>(k)];
            EXPECT_EQ(lamp.lamp, "lamp-" + std::to_string(k));
            EXPECT_EQ(lamp.readings.size(), 200u);
            // Relative to the median of the lamps, which ages as lamps 7 and 8 do.
            const double months = 199 * 7 / (365.25 / 12);
            const double left = (1 - 0.0003 * k * months) / (1 - 0.0003 * 7.5 * months);
            EXPECT_NEAR(lamp.left, left, 0.02) << lamp.lamp;
            EXPECT_GT(lamp.sigma, 0);
            EXPECT_LT(lamp.sigma, 0.02);
        }
        EXPECT_LT(lamps[15].percent_per_month, -0.2);
        EXPECT_GT(lamps[0].percent_per_month, 0.2);
    }
}

TEST(LampAgeing, SaysNothingWithoutIntensitiesOrReadings) {
    auto history = simulated_history(1);
    history.resize(2);
    EXPECT_TRUE(lamp_ageing(history).empty());
    history = simulated_history(1);
    for (DatedLights& dated : history) dated.calibration.intensities_known = false;
    EXPECT_TRUE(lamp_ageing(history).empty());
    EXPECT_TRUE(lamp_ageing({}).empty());
}

TEST(LampAgeing, IsDrawnAndTabulated) {
    const auto lamps = lamp_ageing(simulated_history(1));
    const std::string picture = ageing_picture(lamps);
    EXPECT_THAT(picture, HasSubstr("<svg"));
    EXPECT_THAT(picture, HasSubstr("lamp-15"));
    const std::string table = ageing_table(lamps);
    EXPECT_EQ(std::ranges::count(table, '\n'), 17);
    EXPECT_THAT(table, HasSubstr("lamp-0,200,"));
    EXPECT_THAT(ageing_picture({}), HasSubstr("</svg>"));
}

}  // namespace
}  // namespace darkbox
