#include "firmware/board/atmega32u4/lamp_chain.h"

#include "firmware/board/atmega32u4/pins.h"

namespace darkbox {
namespace board {
namespace {

constexpr uint8_t full_level = 255;

void blank() {
    PORTC |= blank_pin;
    TCCR3A = _BV(WGM30);  // the timer lets go of the pin
}

void unblank(uint8_t level) {
    if (level == full_level) {
        PORTC &= static_cast<uint8_t>(~blank_pin);
        return;
    }
    OCR3A = static_cast<uint8_t>(level - 1);          // low for `level` of 256 counts
    TCNT3 = 0;                                        // every exposure begins with a whole period
    TCCR3A = _BV(WGM30) | _BV(COM3A1) | _BV(COM3A0);  // low from bottom to match
}

void shift(uint8_t byte) {
    SPDR = byte;
    while ((SPSR & _BV(SPIF)) == 0) {
    }
}

}  // namespace

void LampChain::start() {
    PORTC |= blank_pin;
    DDRC |= blank_pin | trigger_pin;
    DDRB |= latch_pin | spi_clock_pin | spi_data_pin | supply_pin;
    SPCR = _BV(SPE) | _BV(MSTR);
    SPSR = _BV(SPI2X);  // 8 MHz
    TCCR3A = _BV(WGM30);
    TCCR3B = _BV(WGM32) | _BV(CS30);  // fast PWM of 8 bits, 62.5 kHz
    show(lampctl::LampSet(), 0);
}

void LampChain::show(const lampctl::LampSet& lamps, uint8_t level) {
    blank();
    PORTB &= static_cast<uint8_t>(~latch_pin);
    for (uint8_t i = lampctl::LampSet::bytes; i > 0; --i) shift(lamps.bits[i - 1]);
    PORTB |= latch_pin;
    if (!lamps.empty() && level != 0) unblank(level);
}

void LampChain::trigger(bool active) {
    if (active)
        PORTC |= trigger_pin;
    else
        PORTC &= static_cast<uint8_t>(~trigger_pin);
}

void LampChain::supply(bool on) {
    if (on)
        PORTB |= supply_pin;
    else
        PORTB &= static_cast<uint8_t>(~supply_pin);
}

}  // namespace board
}  // namespace darkbox
