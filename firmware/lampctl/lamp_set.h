#pragma once

#include <stdint.h>

#include "firmware/protocol/lamp_protocol.h"

namespace darkbox {
namespace lampctl {

/// A set of lamps, as the protocol and the shift registers hold it: lamp n is bit n % 8 of byte n / 8.
class LampSet {
public:
    static constexpr uint8_t bytes = lamp_protocol::most_lamps / 8;

    bool has(uint8_t lamp) const { return (bits[lamp >> 3] & bit(lamp)) != 0; }
    void add(uint8_t lamp) { bits[lamp >> 3] = static_cast<uint8_t>(bits[lamp >> 3] | bit(lamp)); }
    void remove(uint8_t lamp) { bits[lamp >> 3] = static_cast<uint8_t>(bits[lamp >> 3] & ~bit(lamp)); }

    bool empty() const {
        uint8_t any = 0;
        for (uint8_t b : bits) any = static_cast<uint8_t>(any | b);
        return any == 0;
    }
    uint8_t count() const {
        uint8_t n = 0;
        for (uint8_t b : bits)
            for (; b != 0; b = static_cast<uint8_t>(b & (b - 1))) ++n;
        return n;
    }
    /// Whether every lamp is below `lamps`.
    bool within(uint8_t lamps) const {
        for (uint8_t lamp = lamps; lamp < lamp_protocol::most_lamps; ++lamp)
            if (has(lamp)) return false;
        return true;
    }

    uint8_t bits[bytes] = {};

private:
    /// As fast for each lamp: the board's processor shifts by one place at a time.
    static uint8_t bit(uint8_t lamp) {
        uint8_t mask = (lamp & 1) != 0 ? 0x02 : 0x01;
        if ((lamp & 2) != 0) mask = static_cast<uint8_t>(mask << 2);
        if ((lamp & 4) != 0) mask = static_cast<uint8_t>(mask << 4);
        return mask;
    }
};

}  // namespace lampctl
}  // namespace darkbox
