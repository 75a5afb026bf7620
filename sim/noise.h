#pragma once

#include <cstdint>

#include "sim/geometry.h"

namespace darkbox::sim {

/// Smooth noise in three dimensions, about -1 to 1, feature size 1 (Perlin: Improving noise, SIGGRAPH 2002, with hashed
/// gradients in place of the permutation table). Thread-safe, as all here.
double gradient_noise(const Vec3& p, std::uint64_t seed);

/// Noise summed over octaves, each half as large and half as strong; about -1 to 1.
double fractal_noise(const Vec3& p, int octaves, std::uint64_t seed);

/// The nearest of randomly strewn points, one in each unit cell (Worley: A cellular texture basis function, 1996).
struct Cell {
    double nearest = 0.0;  ///< distance to the nearest point
    double second = 0.0;   ///< and to the second nearest
    std::uint64_t id = 0;  ///< random bits of the nearest point
};
Cell cellular_noise(const Vec3& p, std::uint64_t seed);

/// 0 below `low`, 1 above `high`, smooth between.
double smooth_step(double low, double high, double x);

}  // namespace darkbox::sim
