#include "firmware/board/atmega32u4/identity_store.h"

#include <avr/eeprom.h>
#include <avr/wdt.h>

#include "firmware/board/atmega32u4/eeprom_layout.h"

namespace darkbox {
namespace board {

using lamp_protocol::Identity;

namespace {

uint8_t* place(uint8_t offset) { return reinterpret_cast<uint8_t*>(identity_address) + offset; }

}  // namespace

Identity load_identity() {
    Identity identity;
    eeprom_read_block(&identity, place(0), sizeof identity);
    return identity;
}

void store_identity(const Identity& identity) {
    const uint8_t* bytes = reinterpret_cast<const uint8_t*>(&identity);
    for (uint8_t i = 0; i < sizeof identity; ++i) {
        eeprom_update_byte(place(i), bytes[i]);
        wdt_reset();
    }
    eeprom_busy_wait();
}

}  // namespace board
}  // namespace darkbox
