#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "sim/image.h"

namespace darkbox::sim {

/// A sensor, linear but for `nonlinearity`. Plain data.
struct Sensor {
    int bit_depth = 12;          ///< 8 to 16
    double black_level = 64;     ///< sample units
    double full_well_e = 20000;  ///< electrons at full scale, gain 1
    double well_margin = 1.05;   ///< the well holds this times full_well_e: what is saturated clips, noise or not
    double read_noise_e = 5;     ///< standard deviation, before the gain
    double full_scale_radiance = 1.05;  ///< that fills the well in reference_exposure_s
    double reference_exposure_s = 0.02;
    double nonlinearity = 0.0;  ///< a well filled by x counts x + 4 nonlinearity x (1 - x) of full_well_e
    std::uint64_t seed = 1;

    int full_scale() const { return (1 << bit_depth) - 1; }
};

struct ExposureSetting {
    double exposure_s = 0.02;
    double gain = 1.0;
    std::uint64_t frame = 0;  ///< each frame has noise of its own
};

/// The samples of one picture, one for each of `radiance`: shot noise (Poisson) and read noise
/// (normal) in electrons, saturation of the well, gain, black level, rounding, clipping. Model: EMVA 1288, section 2,
/// without the dark current. Same seed, frame and radiance give the same samples.
std::vector<std::uint16_t> expose(const Sensor& sensor, std::span<const float> radiance,
                                  const ExposureSetting& setting);
/// Interleaved RGB.
inline std::vector<std::uint16_t> expose(const Sensor& sensor, const RgbImage& radiance,
                                         const ExposureSetting& setting) {
    return expose(sensor, std::span(radiance.samples), setting);
}

}  // namespace darkbox::sim
