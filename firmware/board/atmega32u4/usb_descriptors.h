#pragma once

#include <avr/pgmspace.h>
#include <stdint.h>

#include "firmware/board/atmega32u4/version.h"
#include "firmware/protocol/lamp_protocol.h"

// Descriptors of USB 2.0, chapter 9; in flash.

namespace darkbox {
namespace board {
namespace descriptors {

using namespace lamp_protocol;

constexpr uint8_t event_size = 16;
constexpr uint8_t vendor_class = 0xFF;

constexpr uint8_t low(uint16_t word) { return static_cast<uint8_t>(word); }
constexpr uint8_t high(uint16_t word) { return static_cast<uint8_t>(word >> 8); }

const uint8_t device[] PROGMEM = {
    18,
    1,
    0x00,
    0x02,  // USB 2.0
    vendor_class,
    0,
    0,
    64,  // endpoint 0
    low(vendor_id),
    high(vendor_id),
    low(product_id),
    high(product_id),
    firmware_minor,
    firmware_major,  // bcdDevice
    1,
    2,
    3,
    1,  // strings; one configuration
};
static_assert(sizeof device == 18, "");

constexpr uint8_t whole_configuration = 9 + 9 + 7 + 7;
const uint8_t configuration[] PROGMEM = {
    9,
    2,
    whole_configuration,
    0,
    1,
    1,
    0,
    0xC0,
    50,  // self-powered, 100 mA
    9,
    4,
    0,
    0,
    2,
    vendor_class,
    0,
    0,
    0,  // interface 0, two endpoints
    7,
    5,
    command_endpoint,
    2,
    largest_packet,
    0,
    0,  // bulk
    7,
    5,
    event_endpoint,
    3,
    event_size,
    0,
    1,  // interrupt, each millisecond
};
static_assert(sizeof configuration == whole_configuration, "");

const uint8_t languages[] PROGMEM = {4, 3, 0x09, 0x04};
const char manufacturer[] PROGMEM = "darkbox";
const char product[] PROGMEM = "darkbox lamp controller";

}  // namespace descriptors
}  // namespace board
}  // namespace darkbox
