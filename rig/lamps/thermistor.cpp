#include "rig/lamps/thermistor.h"

#include <cmath>

namespace darkbox {
namespace {

constexpr double full_scale = 1023;
constexpr double kelvin_at_zero_celsius = 273.15;
constexpr double nominal_kelvin = 298.15;  ///< where its resistance is that of the fixed resistor
constexpr double beta_kelvin = 3950;
constexpr std::uint16_t shorted =
    10;  ///< readings from here to `unplugged` are of a thermistor: some 190 to -60 degrees
constexpr std::uint16_t unplugged = 1010;

}  // namespace

std::optional<double> celsius_of_thermistor(std::uint16_t reading) {
    if (reading < shorted || reading > unplugged) return std::nullopt;
    const double ratio = reading / (full_scale - reading);  // its resistance, over the fixed one
    return 1 / (1 / nominal_kelvin + std::log(ratio) / beta_kelvin) - kelvin_at_zero_celsius;
}

}  // namespace darkbox
