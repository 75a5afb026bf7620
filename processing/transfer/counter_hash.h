#pragma once

#include <cstdint>

namespace darkbox {

/// A random number told by what it is for: no state, so it does not matter who asks first. The mixing of SplitMix64
/// (Steele, Lea and Flood 2014).
inline std::uint32_t counter_hash(std::uint32_t a, std::uint32_t b, std::uint64_t c) {
    std::uint64_t z = (std::uint64_t{a} << 32 | b) + 0x9e3779b97f4a7c15ULL * (c + 1);
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ULL;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebULL;
    return static_cast<std::uint32_t>((z ^ (z >> 31)) >> 32);
}

}  // namespace darkbox
