#include "sim/sensor.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

#include "sim/random.h"

namespace darkbox::sim {
namespace {

/// A Poisson number: by multiplication of uniforms where the mean is small (Knuth, TAOCP 2, 3.4.1), else by a rounded
/// normal one, which no statistics of a picture can tell apart.
double poisson(double mean, CounterRandom& random) {
    if (mean <= 0.0) return 0.0;
    if (mean > 60.0) return std::max(0.0, std::round(mean + std::sqrt(mean) * random.normal()));
    const double limit = std::exp(-mean);
    int count = 0;
    for (double product = random.uniform(); product > limit; product *= random.uniform()) ++count;
    return count;
}

}  // namespace

std::vector<std::uint16_t> expose(const Sensor& sensor, std::span<const float> radiance,
                                  const ExposureSetting& setting) {
    const double electrons_per_radiance =
        sensor.full_well_e / sensor.full_scale_radiance * setting.exposure_s / sensor.reference_exposure_s;
    const double samples_per_electron = setting.gain * (sensor.full_scale() - sensor.black_level) / sensor.full_well_e;
    const CounterRandom frame_random = CounterRandom(sensor.seed).child(setting.frame);
    std::vector<std::uint16_t> samples(radiance.size());
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, radiance.size(), 4096), [&](const auto& range) {
        for (std::size_t i = range.begin(); i < range.end(); ++i) {
            CounterRandom random = frame_random.child(i);
            const double shot = poisson(radiance[i] * electrons_per_radiance, random);
            const double held = std::min(shot, sensor.well_margin * sensor.full_well_e);
            const double bent = 4 * sensor.nonlinearity * held * (1 - held / sensor.full_well_e);
            const double electrons = held + bent + sensor.read_noise_e * random.normal();
            const double sample = std::round(sensor.black_level + samples_per_electron * electrons);
            samples[i] = static_cast<std::uint16_t>(std::clamp(sample, 0.0, double(sensor.full_scale())));
        }
    });
    return samples;
}

}  // namespace darkbox::sim
