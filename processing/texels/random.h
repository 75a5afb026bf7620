#pragma once

#include <cstdint>

namespace darkbox {

/// The mixing of SplitMix64: every bit of the result depends on every bit of `z`.
inline std::uint64_t split_mix(std::uint64_t z) {
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ULL;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebULL;
    return z ^ (z >> 31);
}

/// SplitMix64 (Steele, Lea and Flood 2014): the same numbers with every compiler and library.
/// Thread-compatible.
class SplitMix64 {
public:
    explicit SplitMix64(std::uint64_t seed) : state_(seed) {}

    std::uint64_t next() { return split_mix(state_ += 0x9e3779b97f4a7c15ULL); }

    /// In [0, 1).
    double uniform() { return static_cast<double>(next() >> 11) * 0x1.0p-53; }

private:
    std::uint64_t state_;
};

}  // namespace darkbox
