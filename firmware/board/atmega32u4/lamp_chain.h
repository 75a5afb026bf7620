#pragma once

#include "firmware/lampctl/outputs.h"

namespace darkbox {
namespace board {

/// Eight 74HC595 on SPI; lamp 0 is the first output of the register next to the controller. The drivers' output enable
/// is the blanking, and by PWM of 62.5 kHz the level. It is blanked before a register changes, so no wrong lamp ever
/// flashes. To be called with interrupts off.
class LampChain final : public lampctl::Outputs {
public:
    /// Dark, the supply off: the registers wake up with anything in them.
    void start();
    void show(const lampctl::LampSet& lamps, uint8_t level) override;
    void trigger(bool active) override;
    /// Switches the supply of all lamps.
    void supply(bool on);
};

}  // namespace board
}  // namespace darkbox
