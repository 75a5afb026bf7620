#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "acquisition/frame/frame.h"

namespace darkbox {

/// A frame's samples in one width, rows of `columns` samples: colours of a pixel are columns of their own; of
/// ycc8 the luma alone.
struct Picture {
    int columns = 0;
    int rows = 0;
    std::vector<std::uint16_t> samples;
};

/// The frame's bytes must be as many as its size and format ask for.
Picture to_picture(const Frame& frame);

/// Tells a frame's bytes from others within one run; it differs from machine to machine.
std::uint64_t hash_of(std::span<const std::byte> bytes);

double mean(const Picture& picture);

/// Means over blocks: some 300 samples that still show where the light comes from.
Picture shrink(const Picture& picture);

/// What a sensor's noise comes to: variance = floor + slope · signal, in sample units; signal is above the dark frame.
/// The photon transfer curve: the floor is read noise, the slope shot noise (Janesick, "Photon Transfer", 2007).
struct NoiseModel {
    double floor = 1.0 / 12.0;  ///< at least the quantisation of one step
    double slope = 0.0;
    double variance(double signal) const { return floor + slope * (signal > 0.0 ? signal : 0.0); }
};

/// Fits the noise to two exposures of the same light. Samples at `full_scale` tell nothing and are left out.
NoiseModel measure_noise(const Picture& a, const Picture& b, const Picture& dark, double full_scale);

/// A mean squared difference over what noise explains: 1 = noise alone.
struct NoiseRatio {
    double value = 0.0;
    double sigma = 0.0;  ///< standard deviation of the value when there is noise alone
};

/// How two pictures differ, after `b` is scaled to the mean of `a` (a lamp flickers a little) and both lost the dark.
struct Difference {
    double gain = 1.0;  ///< mean of a over mean of b
    NoiseRatio pixels;  ///< of samples: finds sharp differences
    NoiseRatio blocks;  ///< of sums over blocks of samples: finds faint but smooth ones
};
Difference compare(const Picture& a, const Picture& b, const Picture& dark, const NoiseModel& noise);

/// Correlation of a dark-subtracted picture with the rise of another dark over the first: near 1 when the light that
/// should not be there is the light of the picture.
double correlation(const Picture& lit, const Picture& brightened_dark, const Picture& dark);

}  // namespace darkbox
