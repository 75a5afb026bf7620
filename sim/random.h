#pragma once

#include <cmath>
#include <cstdint>
#include <numbers>

namespace darkbox::sim {

/// The finaliser of splitmix64 (Steele, Lea, Flood: Fast splittable pseudorandom number generators, OOPSLA 2014).
constexpr std::uint64_t mixed(std::uint64_t x) {
    x += 0x9e3779b97f4a7c15ULL;
    x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9ULL;
    x = (x ^ (x >> 27)) * 0x94d049bb133111ebULL;
    return x ^ (x >> 31);
}

/// Random numbers by counter: the same key gives the same numbers on any thread, in any order.
class CounterRandom {
public:
    explicit constexpr CounterRandom(std::uint64_t key) : key_(mixed(key)) {}

    /// A generator of its own for each index.
    constexpr CounterRandom child(std::uint64_t index) const { return CounterRandom(key_ ^ mixed(index + 1)); }

    std::uint64_t bits() { return mixed(key_ + counter_++); }
    /// In (0, 1): never 0, so that its logarithm is finite.
    double uniform() { return (static_cast<double>(bits() >> 12) + 0.5) * 0x1.0p-52; }
    /// Standard normal, by Box and Muller's transform.
    double normal() {
        const double radius = std::sqrt(-2.0 * std::log(uniform()));
        return radius * std::cos(2.0 * std::numbers::pi * uniform());
    }

private:
    std::uint64_t key_;
    std::uint64_t counter_ = 0;
};

}  // namespace darkbox::sim
