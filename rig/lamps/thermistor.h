#pragma once

#include <cstdint>
#include <optional>

namespace darkbox {

/// What the lamp controller's thermistor tells, from the converter's reading (0 to 1023, lower is hotter): 10 kOhm at
/// 25 degrees Celsius with B = 3950 K to ground, 10 kOhm to the converter's reference (docs/lamp-controller.md). No
/// value where it is broken, unplugged or shorted.
std::optional<double> celsius_of_thermistor(std::uint16_t reading);

}  // namespace darkbox
