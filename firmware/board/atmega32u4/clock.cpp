#include "firmware/board/atmega32u4/clock.h"

#include <avr/interrupt.h>
#include <avr/io.h>
#include <util/atomic.h>

namespace darkbox {
namespace board {
namespace {

constexpr int32_t farthest_alarm_us = 20000;  ///< timer 1 wraps after 32.8 ms
/// The interrupt comes this early and waits for the moment itself: what else has interrupts off for shorter than this
/// does not disturb.
constexpr uint8_t early_us = 64;
constexpr uint8_t at_once_us = 4;
constexpr uint8_t half_us = 2;  ///< in a microsecond

uint32_t wraps;       ///< of timer 1
uint16_t last_count;  ///< when it was looked at last
volatile uint8_t ticks_due;
volatile uint16_t alarm_at;  ///< in timer 1's counts

}  // namespace

void start_clock() {
    TCCR1A = 0;
    TCCR1B = _BV(CS11);  // 16 MHz / 8
    TCCR0A = _BV(WGM01);
    OCR0A = 249;
    TCCR0B = _BV(CS01) | _BV(CS00);  // 16 MHz / 64 / 250
    TIMSK0 = _BV(OCIE0A);
}

/// Each tick's interrupt looks at the count, so no wrap passes unseen.
uint32_t now_us() {
    const uint16_t count = TCNT1;
    if (count < last_count) ++wraps;
    last_count = count;
    return (wraps << 15) + (count >> 1);
}

void set_alarm(uint32_t at_us) {
    int32_t ahead_us = static_cast<int32_t>(at_us - now_us());
    const uint16_t now = TCNT1;
    clear_alarm();
    if (ahead_us > farthest_alarm_us) return;
    if (ahead_us < at_once_us) ahead_us = at_once_us;
    alarm_at = static_cast<uint16_t>(now + half_us * static_cast<uint16_t>(ahead_us));
    OCR1A = ahead_us > early_us + at_once_us ? static_cast<uint16_t>(alarm_at - half_us * early_us)
                                             : static_cast<uint16_t>(now + half_us * at_once_us);
    TIFR1 = _BV(OCF1A);
    TIMSK1 = _BV(OCIE1A);
}

void clear_alarm() { TIMSK1 = 0; }

bool take_tick() {
    bool taken = false;
    ATOMIC_BLOCK(ATOMIC_RESTORESTATE) {
        if (ticks_due != 0) {
            --ticks_due;
            taken = true;
        }
    }
    return taken;
}

}  // namespace board
}  // namespace darkbox

ISR(TIMER0_COMPA_vect) {
    darkbox::board::now_us();
    ++darkbox::board::ticks_due;
}

ISR(TIMER1_COMPA_vect) {
    darkbox::board::clear_alarm();
    while (static_cast<int16_t>(TCNT1 - darkbox::board::alarm_at) < 0) {
    }
    darkbox::board::on_alarm();
}
