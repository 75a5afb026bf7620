#include "rig/health/linearity.h"

#include <gtest/gtest.h>

#include "acquisition/frame/error.h"

namespace darkbox {
namespace {

/// Signals of x = exposure, bent by `amount` at half scale.
std::vector<ExposedSignal> bent(double amount, double offset = 0) {
    std::vector<ExposedSignal> sweep;
    for (int i = 1; i <= 100; ++i) {
        const double x = i / 100.0;
        sweep.push_back({Seconds(x), x + 4 * amount * x * (1 - x) + offset});
    }
    return sweep;
}

TEST(Linearity, OfALineIsExact) {
    const Linearity found = measure_linearity(bent(0));
    EXPECT_NEAR(found.deviation, 0, 1e-12);
    EXPECT_DOUBLE_EQ(found.top, 1);
}

/// Over a full sweep from 0 to 1 the line through the origin has the slope 1 + amount, and the parabola lies furthest
/// from it at the top: by the amount itself.
TEST(Linearity, OfAParabolaIsWhatItBendsBy) {
    for (const double amount : {0.005, 0.01, 0.03}) {
        const Linearity found = measure_linearity(bent(amount));
        EXPECT_NEAR(found.deviation, amount, 0.03 * amount);
        EXPECT_DOUBLE_EQ(found.worst.count(), 1);
    }
}

TEST(Linearity, CountsAnOffset) { EXPECT_GT(measure_linearity(bent(0, 0.02)).deviation, 0.015); }

TEST(Linearity, RefusesDarkness) {
    EXPECT_THROW(measure_linearity({{Seconds(1), 0}, {Seconds(2), 0}, {Seconds(3), 0}}), InputError);
    EXPECT_THROW(measure_linearity({{Seconds(1), 1}, {Seconds(2), 2}}), InputError);
}

}  // namespace
}  // namespace darkbox
