#pragma once

#include <stdint.h>

namespace darkbox {
namespace board {

// Timer 1 counts half microseconds and gives the alarm; timer 0 ticks each millisecond. Interrupts off where it says
// so.

void start_clock();

/// Microseconds since the start; wraps. Interrupts off.
uint32_t now_us();

/// Calls on_alarm() from an interrupt, at that microsecond or at once if it is past. Moments farther off than 20 ms are
/// not taken: ask again at the next tick. Interrupts off.
void set_alarm(uint32_t at_us);
void clear_alarm();
/// The board's own; runs with interrupts off.
void on_alarm();

/// Milliseconds that passed and nobody took yet. Takes one.
bool take_tick();

}  // namespace board
}  // namespace darkbox
