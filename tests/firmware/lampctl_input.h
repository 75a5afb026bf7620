#pragma once

#include <cstddef>
#include <cstdint>

namespace darkbox::test {

/// Plays any bytes to the controller's core: packets, whole and broken, time, strobes, heat, lost hosts, identities. A
/// judge of its own watches the lamps. Throws std::logic_error when more lamps are lit than allowed, longer than
/// allowed, for a silent host, or too hot.
void play_to_lampctl(const std::uint8_t* bytes, std::size_t size);

}  // namespace darkbox::test
