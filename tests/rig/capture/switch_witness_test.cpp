#include "rig/capture/switch_witness.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

namespace darkbox {
namespace {

constexpr int columns = 40;
constexpr double witness_full_scale = 4095, witness_black = 64;
constexpr NoiseModel witness_noise{4.0, 0.05};

/// Two lamps over one body, a camera whose rows are exposed one after another, and the moment of a switch between them.
class SwitchWitness : public testing::Test {
protected:
    double light(int lamp, int x, int y) const {
        const double side = lamp == 0 ? x : columns - x;
        return 300 + 30 * side + 240.0 * y / rows;
    }

    /// `before` and `after`: shares of the two lamps at a height of 0 to 1.
    template <typename Shares>
    Picture picture(const Shares& shares) {
        Picture p{columns, rows, {}};
        for (int y = 0; y < rows; ++y) {
            const LightShares s = shares(y / (rows - 1.0));
            for (int x = 0; x < columns; ++x) {
                const double signal = s.before * light(0, x, y) + s.after * light(1, x, y);
                std::normal_distribution<double> deviate(witness_black + signal,
                                                         std::sqrt(witness_noise.variance(signal)));
                p.samples.push_back(
                    static_cast<std::uint16_t>(std::clamp(std::round(deviate(random)), 0.0, witness_full_scale)));
            }
        }
        return p;
    }

    /// Exposures as the unit of time: the switch at 0.6, rows from 0 to `readout` on, the stamp off by `lie`.
    static LightShares shares(double height, double readout, double lie) {
        const double after = std::clamp(1 - (0.6 + lie - height * readout), 0.0, 1.0);
        return {1 - after, after};
    }

    WitnessReport hear(double readout, double lie, const WitnessTolerance& tolerance = {0.05, 0.05}) {
        const Picture dark = picture([](double) { return LightShares{0, 0}; });
        const Picture before = picture([](double) { return LightShares{1, 0}; });
        const Picture after = picture([](double) { return LightShares{0, 1}; });
        const Picture spoiled = picture([&](double height) { return shares(height, readout, lie); });
        return hear_witness(
            {&dark, &before, &spoiled, &after}, witness_noise, witness_full_scale,
            [&](double height) { return shares(height, readout, 0); }, tolerance);
    }

    int rows = 48;
    std::mt19937 random{3};
};

TEST_F(SwitchWitness, BearsOutHonestStamps) {
    for (const double readout : {0.0, 0.3, 0.9}) {
        const WitnessReport report = hear(readout, 0);
        EXPECT_TRUE(report.informative) << readout;
        EXPECT_TRUE(report.agrees) << readout << ": " << report.latest << " " << report.earliest;
    }
}

TEST_F(SwitchWitness, ContradictsStampsThatAreOffEitherWay) {
    for (const double readout : {0.0, 0.3, 0.9}) {
        for (const double lie : {0.08, 0.2, 0.5, 1.5, -0.08, -0.2, -0.5, -1.5}) {
            const WitnessReport report = hear(readout, lie);
            EXPECT_TRUE(report.informative && !report.agrees) << readout << " " << lie;
            if (std::abs(lie) < 0.3 && readout == 0) {
                EXPECT_NEAR(report.latest, std::max(0.0, lie), 0.03);
                EXPECT_NEAR(report.earliest, std::max(0.0, -lie), 0.03);
            }
        }
    }
}

/// Short exposures of a camera that reads out slowly: a row sees much more of the switch than the next band's.
TEST_F(SwitchWitness, TellsWhenTheReadOutIsManyExposuresLong) {
    rows = 720;
    for (const double readout : {3.0, 6.0, 12.0}) {
        const WitnessReport honest = hear(readout, 0);
        EXPECT_TRUE(honest.informative && honest.agrees) << readout << ": " << honest.latest << " " << honest.earliest;
        for (const double lie : {0.12, 0.5, 1.5, -0.12, -0.5}) {
            const WitnessReport report = hear(readout, lie);
            EXPECT_TRUE(report.informative && !report.agrees) << readout << " " << lie;
        }
    }
}

TEST_F(SwitchWitness, SaysThatItTellsNothingWhenTheSwitchFellIntoTheGap) {
    const Picture dark = picture([](double) { return LightShares{0, 0}; });
    const Picture before = picture([](double) { return LightShares{1, 0}; });
    const Picture after = picture([](double) { return LightShares{0, 1}; });
    const WitnessReport report = hear_witness({&dark, &before, &before, &after}, witness_noise, witness_full_scale,
                                              [](double) { return LightShares{1, 0}; }, {0.05, 0.05});
    EXPECT_FALSE(report.informative);
    EXPECT_TRUE(report.agrees);
}

TEST_F(SwitchWitness, LampsThatLookAlikeTellNothing) {
    const Picture dark = picture([](double) { return LightShares{0, 0}; });
    const Picture one = picture([](double) { return LightShares{1, 0}; });
    const WitnessReport report = hear_witness({&dark, &one, &one, &one}, witness_noise, witness_full_scale,
                                              [](double) { return LightShares{0.5, 0.5}; }, {0.05, 0.05});
    EXPECT_FALSE(report.informative);
}

TEST_F(SwitchWitness, BandsShowAFewRowsOfForeignLight) {
    const Picture dark = picture([](double) { return LightShares{0, 0}; });
    const Picture before = picture([](double) { return LightShares{1, 0}; });
    const Picture after = picture([](double) { return LightShares{0, 1}; });
    const Picture pure = picture([](double) { return LightShares{0, 1}; });
    const Picture tinged =
        picture([](double height) { return height < 0.05 ? LightShares{0.2, 0.8} : LightShares{0, 1}; });
    EXPECT_LE(compare_bands({&dark, &before, &pure, &after}, witness_noise, witness_full_scale).most_before, 0.002);
    EXPECT_GE(compare_bands({&dark, &before, &tinged, &after}, witness_noise, witness_full_scale).most_before, 0.1);
}

/// Most of a real picture is backdrop: noise, and lamps that look alike in it, must accuse nobody.
TEST_F(SwitchWitness, RowsWithHardlyAnyLightAccuseNobody) {
    const auto faint = [](double share) { return [=](double) { return LightShares{share, 0.004 * (1 - share)}; }; };
    for (int run = 0; run < 20; ++run) {
        const Picture dark = picture([](double) { return LightShares{0, 0}; });
        const Picture before = picture([](double) { return LightShares{0.004, 0.0001}; });
        const Picture one = picture(faint(0.0)), two = picture(faint(0.0));
        const BandLights lights = compare_bands({&dark, &before, &one, &two}, witness_noise, witness_full_scale);
        EXPECT_LE(lights.most_before, 0.002);
        EXPECT_LE(lights.most_missing, 0.03);
    }
}

}  // namespace
}  // namespace darkbox
