#include "sim/noise.h"

#include <algorithm>
#include <array>

#include "sim/random.h"

namespace darkbox::sim {
namespace {

struct Lattice {
    std::int64_t x, y, z;
};

std::uint64_t hash(const Lattice& c, std::uint64_t seed) {
    const auto u = [](std::int64_t i) { return static_cast<std::uint64_t>(i); };
    return mixed(seed ^ (u(c.x) * 0x8da6b343U + u(c.y) * 0xd8163841ULL + u(c.z) * 0xcb1ab31fULL * 0x10001ULL));
}

Lattice cell_of(const Vec3& p) {
    const auto down = [](double x) { return static_cast<std::int64_t>(std::floor(x)); };
    return {down(p.x), down(p.y), down(p.z)};
}

constexpr double fade(double t) { return t * t * t * (t * (t * 6.0 - 15.0) + 10.0); }

/// The dot product with one of the twelve directions to the edges of a cube.
double gradient_dot(std::uint64_t bits, const Vec3& d) {
    const int h = static_cast<int>(bits % 12);
    const double a = h < 8 ? d.x : d.y;
    const double b = h < 4 ? d.y : d.z;
    return ((h & 1) != 0 ? -a : a) + ((h & 2) != 0 ? -b : b);
}

double lerp(double t, double a, double b) { return a + t * (b - a); }

}  // namespace

double gradient_noise(const Vec3& p, std::uint64_t seed) {
    const Lattice c = cell_of(p);
    const Vec3 f{p.x - static_cast<double>(c.x), p.y - static_cast<double>(c.y), p.z - static_cast<double>(c.z)};
    const auto corner = [&](int i, int j, int k) {
        return gradient_dot(hash({c.x + i, c.y + j, c.z + k}, seed), f - Vec3{double(i), double(j), double(k)});
    };
    const double u = fade(f.x);
    const double v = fade(f.y);
    const auto face = [&](int k) {
        return lerp(v, lerp(u, corner(0, 0, k), corner(1, 0, k)), lerp(u, corner(0, 1, k), corner(1, 1, k)));
    };
    return lerp(fade(f.z), face(0), face(1));
}

double fractal_noise(const Vec3& p, int octaves, std::uint64_t seed) {
    double sum = 0.0;
    double strength = 1.0;
    double frequency = 1.0;
    double total = 0.0;
    for (int i = 0; i < octaves; ++i) {
        sum += strength * gradient_noise(p * frequency, seed + static_cast<std::uint64_t>(i));
        total += strength;
        strength *= 0.5;
        frequency *= 2.03;  // not 2: the lattices of the octaves must not fall upon each other
    }
    return 1.6 * sum / total;
}

Cell cellular_noise(const Vec3& p, std::uint64_t seed) {
    const Lattice c = cell_of(p);
    Cell result{1e9, 1e9, 0};
    for (int k = -1; k <= 1; ++k)
        for (int j = -1; j <= 1; ++j)
            for (int i = -1; i <= 1; ++i) {
                const Lattice cell{c.x + i, c.y + j, c.z + k};
                CounterRandom random(hash(cell, seed));
                const Vec3 point{static_cast<double>(cell.x) + random.uniform(),
                                 static_cast<double>(cell.y) + random.uniform(),
                                 static_cast<double>(cell.z) + random.uniform()};
                const double distance = length(p - point);
                if (distance < result.nearest)
                    result = {distance, result.nearest, random.bits()};
                else
                    result.second = std::min(result.second, distance);
            }
    return result;
}

double smooth_step(double low, double high, double x) {
    const double t = std::clamp((x - low) / (high - low), 0.0, 1.0);
    return t * t * (3.0 - 2.0 * t);
}

}  // namespace darkbox::sim
