#include "firmware/lampctl/identity.h"

namespace darkbox {
namespace lampctl {

using lamp_protocol::Identity;

namespace {

bool serial_character(char c) {
    return (c >= '0' && c <= '9') || (c >= 'A' && c <= 'Z') || (c >= 'a' && c <= 'z') || c == '-';
}

bool label_character(char c) { return c >= ' ' && c <= '~'; }

/// Some of these characters, then zeros to the end.
bool text(const char* text, uint8_t room, bool (*allowed)(char), uint8_t least) {
    uint8_t length = 0;
    while (length < room && text[length] != 0) {
        if (!allowed(text[length])) return false;
        ++length;
    }
    for (uint8_t i = length; i < room; ++i)
        if (text[i] != 0) return false;
    return length >= least;
}

}  // namespace

bool valid(const Identity& i) {
    if (lamp_protocol::crc16(&i, offsetof(Identity, crc)) != i.crc) return false;
    return i.layout == lamp_protocol::identity_layout && i.lamps >= 1 && i.lamps <= lamp_protocol::most_lamps &&
           i.most_lit >= 1 && i.most_lit <= lamp_protocol::most_lit_of_any_board && i.most_on_ms >= 1 &&
           i.most_on_ms <= lamp_protocol::longest_on_ms && i.hot >= 1 && i.hot <= lamp_protocol::coolest_hot &&
           i.reserved == 0 && i.reserved_2 == 0 && text(i.serial, sizeof i.serial, serial_character, 1) &&
           text(i.label, sizeof i.label, label_character, 0);
}

}  // namespace lampctl
}  // namespace darkbox
