#pragma once

#include <stdint.h>

namespace darkbox {
namespace board {

/// Where the identity lies. Not the first bytes: a brown-out during a write hits address 0 first.
constexpr uint16_t identity_address = 16;

}  // namespace board
}  // namespace darkbox
