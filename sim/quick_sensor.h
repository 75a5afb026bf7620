#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "sim/sensor.h"

namespace darkbox::sim {

/// Light on the sensor: this share of what the samples hold.
struct LightShare {
    float share = 0.0F;
    std::span<const float> radiance;
};

/// Exposes as expose() does, in a few nanoseconds a sample: for a camera that keeps real time. Its normal deviates are
/// made once, and drawn from a random place on and with a random sign for every 1024 samples of a frame. Shot noise is
/// normal, not Poisson's, with the same mean and variance: it differs where there are few electrons, by its skewness.
/// Same seed, frame and light give the same samples. Const members are thread-safe.
class QuickSensor {
public:
    explicit QuickSensor(std::uint64_t seed);

    /// The samples of one picture under the sum of these lights; every light has as many samples as the result.
    void expose(const Sensor& sensor, std::span<const LightShare> lights, const ExposureSetting& setting,
                std::span<std::uint16_t> samples) const;

private:
    std::uint64_t seed_;
    std::vector<float> deviates_;  ///< of mean 0 and variance 1
};

}  // namespace darkbox::sim
