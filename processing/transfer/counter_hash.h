#pragma once

#include <cstdint>

#include "processing/texels/random.h"

namespace darkbox {

/// A random number told by what it is for: no state, so it does not matter who asks first. Mixed as by
/// SplitMix64 (Steele, Lea and Flood 2014).
inline std::uint32_t counter_hash(std::uint32_t a, std::uint32_t b, std::uint64_t c) {
    return static_cast<std::uint32_t>(split_mix((std::uint64_t{a} << 32 | b) + 0x9e3779b97f4a7c15ULL * (c + 1)) >> 32);
}

}  // namespace darkbox
