#include "rig/lamps/thermistor.h"

#include <gtest/gtest.h>

namespace darkbox {
namespace {

TEST(Thermistor, ReadsTheTableOfItsMaker) {
    // Resistances of a 10 kOhm, B 3950 part by its own equation; the reading is 1023 R / (R + 10 kOhm).
    EXPECT_NEAR(*celsius_of_thermistor(512), 25.0, 0.1);
    EXPECT_NEAR(*celsius_of_thermistor(788), 0.0, 0.3);   // 33.62 kOhm
    EXPECT_NEAR(*celsius_of_thermistor(204), 60.0, 0.3);  // 2.486 kOhm
    EXPECT_NEAR(*celsius_of_thermistor(100), 85.0, 0.3);  // 1.087 kOhm
}

TEST(Thermistor, IsNotBelievedWhenItIsBroken) {
    EXPECT_FALSE(celsius_of_thermistor(0));
    EXPECT_FALSE(celsius_of_thermistor(1023));
    EXPECT_FALSE(celsius_of_thermistor(1011));
    EXPECT_TRUE(celsius_of_thermistor(1010));
    double last = 1e9;
    for (std::uint16_t reading = 10; reading <= 1010; ++reading) {
        EXPECT_LT(*celsius_of_thermistor(reading), last);
        last = *celsius_of_thermistor(reading);
    }
}

}  // namespace
}  // namespace darkbox
