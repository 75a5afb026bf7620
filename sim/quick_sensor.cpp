#include "sim/quick_sensor.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "sim/random.h"

namespace darkbox::sim {
namespace {

/// What fits into a processor's nearest caches, and is far more than a block.
constexpr std::size_t deviate_count = std::size_t{1} << 16;
constexpr std::size_t block = 1024;

/// A run of deviates, each to be multiplied by `sign`.
struct Deviates {
    const float* first;
    float sign;
};

Deviates draw(const std::vector<float>& deviates, CounterRandom& random) {
    const std::uint64_t bits = random.bits();
    return {deviates.data() + (bits >> 1U) % (deviates.size() - block), (bits & 1U) != 0 ? 1.0F : -1.0F};
}

/// The sensor's numbers as the inner loop wants them.
struct Steps {
    float electrons_per_radiance, samples_per_electron, well, bend, per_well, read_noise, black, full_scale;
};

void expose_block(const Steps& s, const float* light, Deviates shot, Deviates read, std::size_t count,
                  std::uint16_t* samples) {
    const float read_noise = s.read_noise * read.sign;
    for (std::size_t i = 0; i < count; ++i) {
        const float mean = light[i] * s.electrons_per_radiance;
        const float counted = mean + std::sqrt(mean) * shot.first[i] * shot.sign;
        const float held = std::min(counted, s.well);
        const float electrons = held + s.bend * held * (1.0F - held * s.per_well) + read_noise * read.first[i];
        const float sample = s.black + s.samples_per_electron * electrons + 0.5F;
        samples[i] = static_cast<std::uint16_t>(static_cast<std::int32_t>(std::clamp(sample, 0.0F, s.full_scale)));
    }
}

}  // namespace

QuickSensor::QuickSensor(std::uint64_t seed) : seed_(seed), deviates_(deviate_count) {
    CounterRandom random = CounterRandom(seed).child(deviate_count);
    double sum = 0.0, squares = 0.0;
    for (float& deviate : deviates_) {
        deviate = static_cast<float>(random.normal());
        sum += deviate;
        squares += static_cast<double>(deviate) * deviate;
    }
    const double mean = sum / deviate_count;
    const double sigma = std::sqrt(squares / deviate_count - mean * mean);
    for (float& deviate : deviates_) deviate = static_cast<float>((deviate - mean) / sigma);
}

void QuickSensor::expose(const Sensor& sensor, std::span<const LightShare> lights, const ExposureSetting& setting,
                         std::span<std::uint16_t> samples) const {
    const double well = sensor.full_well_e;
    Steps steps{};
    steps.electrons_per_radiance =
        static_cast<float>(well / sensor.full_scale_radiance * setting.exposure_s / sensor.reference_exposure_s);
    steps.samples_per_electron = static_cast<float>(setting.gain * (sensor.full_scale() - sensor.black_level) / well);
    steps.well = static_cast<float>(sensor.well_margin * well);
    steps.bend = static_cast<float>(4 * sensor.nonlinearity);
    steps.per_well = static_cast<float>(1 / well);
    steps.read_noise = static_cast<float>(sensor.read_noise_e);
    steps.black = static_cast<float>(sensor.black_level);
    steps.full_scale = static_cast<float>(sensor.full_scale());
    const CounterRandom frame_random = CounterRandom(seed_).child(setting.frame);
    std::array<float, block> light{};
    for (std::size_t begin = 0; begin < samples.size(); begin += block) {
        const std::size_t count = std::min(block, samples.size() - begin);
        light.fill(0.0F);
        for (const LightShare& l : lights)
            for (std::size_t i = 0; i < count; ++i) light[i] += l.share * l.radiance[begin + i];
        CounterRandom random = frame_random.child(begin);
        const Deviates shot = draw(deviates_, random);
        const Deviates read = draw(deviates_, random);
        expose_block(steps, light.data(), shot, read, count, samples.data() + begin);
    }
}

}  // namespace darkbox::sim
