#pragma once

#include <stdint.h>

namespace darkbox {
namespace board {

constexpr uint8_t firmware_major = 1;
constexpr uint8_t firmware_minor = 0;

}  // namespace board
}  // namespace darkbox
