#include "sim/reflectance.h"

#include <algorithm>
#include <cmath>

namespace darkbox::sim {
namespace {

constexpr double facing_reflectance = 0.04;  // of a dielectric of index 1.5

/// Schlick: An inexpensive BRDF model, Eurographics 1994.
double fresnel(double cosine) {
    const double x = 1.0 - cosine;
    return facing_reflectance + (1.0 - facing_reflectance) * x * x * x * x * x;
}

/// Smith's masking of one direction, divided by twice the cosine.
double smith_over_cosine(double cosine, double alpha) {
    return 1.0 / (cosine + std::sqrt(alpha * alpha + (1.0 - alpha * alpha) * cosine * cosine));
}

}  // namespace

double phong_lobe(const Vec3& n, const Vec3& l, const Vec3& v, double strength, double exponent) {
    const double along_mirror = dot(mirrored(-l, n), v);
    return along_mirror > 0.0 ? strength * std::pow(along_mirror, exponent) / dot(n, l) : 0.0;
}

double ggx(const Vec3& n, const Vec3& l, const Vec3& v, double alpha) {
    const Vec3 half = unit(l + v);
    const double n_dot_h = std::max(dot(n, half), 0.0);
    const double spread = n_dot_h * n_dot_h * (alpha * alpha - 1.0) + 1.0;
    const double facets_times_pi = alpha * alpha / (spread * spread);
    return facets_times_pi * fresnel(dot(l, half)) * smith_over_cosine(dot(n, l), alpha) *
           smith_over_cosine(dot(n, v), alpha);
}

double coat_transmission(const Vec3& n, const Vec3& l, const Vec3& v) {
    return (1.0 - fresnel(dot(n, l))) * (1.0 - fresnel(dot(n, v)));
}

double oren_nayar(const Vec3& n, const Vec3& l, const Vec3& v, double slope_sigma) {
    const double variance = slope_sigma * slope_sigma;
    const double a = 1.0 - 0.5 * variance / (variance + 0.33);
    const double b = 0.45 * variance / (variance + 0.09);
    // cos(azimuth) sin(alpha) tan(beta) of the paper, without its angles.
    const double opposed = dot(l, v) - dot(n, l) * dot(n, v);
    return a + b * std::max(opposed, 0.0) / std::max(dot(n, l), dot(n, v));
}

}  // namespace darkbox::sim
