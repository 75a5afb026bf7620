#include "firmware/lampctl/budgets.h"

namespace darkbox {
namespace lampctl {

using lamp_protocol::most_lamps;
using lamp_protocol::no_lamp;

namespace {

constexpr uint8_t round_ms = most_lamps;  ///< one lamp is cooled each millisecond

}  // namespace

Budgets::Budgets() {
    for (uint8_t lamp = 0; lamp < most_lamps; ++lamp) {
        max_on_ms_[lamp] = max_on_at_start_ms;
        used_ms_[lamp] = 0;
        cooling_[lamp] = cooling_at_start;
    }
}

void Budgets::limit(uint8_t lamp, uint16_t max_on_ms, uint8_t cooling) {
    max_on_ms_[lamp] = max_on_ms;
    cooling_[lamp] = cooling;
}

uint32_t Budgets::rest_ms(uint8_t lamp) const {
    if (may_light(lamp)) return 0;
    const uint16_t too_much = static_cast<uint16_t>(used_ms_[lamp] - max_on_ms_[lamp]);
    const uint32_t rounds = static_cast<uint32_t>(too_much / cooling_[lamp]) + 1;
    return (rounds + 1) * round_ms;  // the round that runs counts only if it was dark from its start
}

void Budgets::switched(const LampSet& before, const LampSet& after) {
    for (uint8_t byte = 0; byte < LampSet::bytes; ++byte) {
        const uint8_t lit_now = static_cast<uint8_t>(after.bits[byte] & ~before.bits[byte]);
        if (lit_now == 0) continue;
        lit_this_round_.bits[byte] = static_cast<uint8_t>(lit_this_round_.bits[byte] | lit_now);
        for (uint8_t lamp = static_cast<uint8_t>(byte * 8), mask = lit_now; mask != 0;
             ++lamp, mask = static_cast<uint8_t>(mask >> 1))
            if ((mask & 1) != 0) ++used_ms_[lamp];
    }
}

uint8_t Budgets::tick(const LampSet& lit) {
    uint8_t over = no_lamp;
    for (uint8_t byte = 0; byte < LampSet::bytes; ++byte)
        for (uint8_t lamp = static_cast<uint8_t>(byte * 8), mask = lit.bits[byte]; mask != 0;
             ++lamp, mask = static_cast<uint8_t>(mask >> 1)) {
            if ((mask & 1) == 0) continue;
            if (used_ms_[lamp] >= max_on_ms_[lamp])
                over = lamp;
            else
                ++used_ms_[lamp];
        }
    cool(next_to_cool_, lit);
    next_to_cool_ = static_cast<uint8_t>((next_to_cool_ + 1) % most_lamps);
    return over;
}

void Budgets::cool(uint8_t lamp, const LampSet& lit) {
    if (!lit_this_round_.has(lamp))
        used_ms_[lamp] = used_ms_[lamp] > cooling_[lamp] ? static_cast<uint16_t>(used_ms_[lamp] - cooling_[lamp]) : 0;
    if (!lit.has(lamp)) lit_this_round_.remove(lamp);
}

}  // namespace lampctl
}  // namespace darkbox
