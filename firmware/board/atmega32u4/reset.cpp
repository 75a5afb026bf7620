#include "firmware/board/atmega32u4/reset.h"

#include <avr/interrupt.h>
#include <avr/io.h>
#include <avr/wdt.h>

namespace darkbox {
namespace board {
namespace {

constexpr uint32_t bootloader_wanted = 0xB0071E57;
constexpr uint16_t bootloader_words = 0x7000 / 2;  ///< Atmel's DFU loader, as the chip is sold

uint8_t cause __attribute__((section(".noinit")));
uint32_t wanted __attribute__((section(".noinit")));

}  // namespace

/// Before the C runtime: a watchdog that has bitten goes on at its shortest time until it is told to stop.
void after_reset() __attribute__((naked, used, section(".init3")));
void after_reset() {
    cause = MCUSR;
    MCUSR = 0;
    wdt_disable();
    if ((cause & _BV(WDRF)) != 0 && wanted == bootloader_wanted) {
        wanted = 0;
        reinterpret_cast<void (*)()>(bootloader_words)();
    }
    wanted = 0;
}

uint8_t reset_cause() { return cause; }

void reset_into_bootloader() {
    cli();
    wanted = bootloader_wanted;
    wdt_enable(WDTO_15MS);
    for (;;) {
    }
}

}  // namespace board
}  // namespace darkbox
