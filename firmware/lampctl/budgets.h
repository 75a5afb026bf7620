#pragma once

#include <stdint.h>

#include "firmware/lampctl/lamp_set.h"

namespace darkbox {
namespace lampctl {

/// How long each lamp may still be lit. Lit time is charged when a lamp is lit and at each millisecond that finds it
/// lit, so a flash costs its length rounded up. What a lamp used, it regains only over rounds of 64 ms in which it was
/// dark throughout: the longest stretch is max_on_ms, and no pattern of flashes exceeds the share of
/// cooling / (64 + cooling) but by one max_on_ms.
class Budgets {
public:
    static constexpr uint16_t max_on_at_start_ms = 1000;
    static constexpr uint8_t cooling_at_start = 64;  ///< half of the time

    Budgets();
    void limit(uint8_t lamp, uint16_t max_on_ms, uint8_t cooling);
    uint16_t max_on_ms(uint8_t lamp) const { return max_on_ms_[lamp]; }

    bool may_light(uint8_t lamp) const { return used_ms_[lamp] < max_on_ms_[lamp]; }
    /// Until may_light(), if it stays dark.
    uint32_t rest_ms(uint8_t lamp) const;
    /// `before` are lit now, `after` from now on.
    void switched(const LampSet& before, const LampSet& after);
    /// Once a millisecond. Returns a lamp that must go dark now, or no_lamp.
    uint8_t tick(const LampSet& lit);

private:
    void cool(uint8_t lamp, const LampSet& lit);

    uint16_t max_on_ms_[lamp_protocol::most_lamps];
    uint16_t used_ms_[lamp_protocol::most_lamps];
    uint8_t cooling_[lamp_protocol::most_lamps];
    LampSet lit_this_round_;
    uint8_t next_to_cool_ = 0;
};

}  // namespace lampctl
}  // namespace darkbox
