#pragma once

#include <cstddef>
#include <cstdint>

namespace darkbox::test {

/// Reads any bytes as everything that a lamp controller may answer. Throws std::logic_error when something comes out
/// that the protocol does not have.
void play_to_lamp_packets(const std::uint8_t* bytes, std::size_t size);

}  // namespace darkbox::test
