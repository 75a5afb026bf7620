#pragma once

#include <stdint.h>

namespace darkbox {
namespace board {

/// Why the controller started: lamp_protocol::ResetCause bits.
uint8_t reset_cause();
/// Starts the bootloader in a freshly reset chip, by way of the watchdog. Lamps and supply are off by then: the reset
/// lets go of every pin.
[[noreturn]] void reset_into_bootloader();

}  // namespace board
}  // namespace darkbox
