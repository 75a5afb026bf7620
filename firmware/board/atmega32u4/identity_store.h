#pragma once

#include "firmware/protocol/lamp_protocol.h"

namespace darkbox {
namespace board {

/// The identity as EEPROM holds it, be it valid or not.
lamp_protocol::Identity load_identity();
/// Takes up to 170 ms and keeps the watchdog quiet meanwhile: only while the lamps are dark. Cut short, what lies there
/// has a wrong CRC.
void store_identity(const lamp_protocol::Identity& identity);

}  // namespace board
}  // namespace darkbox
