#pragma once

#include <cstdint>

#include "acquisition/frame/frame.h"

namespace darkbox::test {

/// SplitMix64 (Steele, Lea, Flood 2014): the same bits on every machine.
class Random {
public:
    explicit Random(std::uint64_t seed) : state_(seed) {}
    std::uint64_t next() {
        std::uint64_t z = (state_ += 0x9E3779B97F4A7C15);
        z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9;
        z = (z ^ (z >> 27)) * 0x94D049BB133111EB;
        return z ^ (z >> 31);
    }

private:
    std::uint64_t state_;
};

/// A frame of noise that `seed` alone decides; sequence = seed.
inline Frame noise_frame(PixelFormat format, int width, int height, std::uint64_t seed) {
    Frame frame;
    frame.width = width;
    frame.height = height;
    frame.format = format;
    frame.bit_depth = bytes_per_sample(format) == 2 ? 12 : 8;
    frame.black_level = 64.5;
    frame.sequence = seed;
    frame.timestamp = TimePoint(Nanoseconds(1'000'000'007 * (seed + 1)));
    frame.controls = {Seconds(0.0125), 1.5};
    Random random(seed);
    const std::size_t samples = static_cast<std::size_t>(width) * height * channels(format);
    frame.pixels.reserve(samples * bytes_per_sample(format));
    for (std::size_t i = 0; i < samples; ++i) {
        const auto sample = static_cast<std::uint32_t>(random.next() & ((1u << frame.bit_depth) - 1));
        frame.pixels.push_back(static_cast<std::byte>(sample & 0xFF));
        if (bytes_per_sample(format) == 2) frame.pixels.push_back(static_cast<std::byte>(sample >> 8));
    }
    return frame;
}

}  // namespace darkbox::test
