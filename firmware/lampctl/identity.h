#pragma once

#include "firmware/protocol/lamp_protocol.h"

namespace darkbox {
namespace lampctl {

/// Whether the CRC holds and every field is in its range.
bool valid(const lamp_protocol::Identity& identity);

}  // namespace lampctl
}  // namespace darkbox
