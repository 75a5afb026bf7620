#pragma once

#include <cmath>

namespace darkbox::sim {

/// A point or direction in the viewer frame: x right, y up, z from the object to the camera; millimetres where it is a
/// point.
struct Vec3 {
    double x = 0.0;
    double y = 0.0;
    double z = 0.0;

    Vec3& operator+=(const Vec3& b) { return x += b.x, y += b.y, z += b.z, *this; }
};

constexpr Vec3 operator+(const Vec3& a, const Vec3& b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
constexpr Vec3 operator-(const Vec3& a, const Vec3& b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
constexpr Vec3 operator-(const Vec3& a) { return {-a.x, -a.y, -a.z}; }
constexpr Vec3 operator*(const Vec3& a, double s) { return {a.x * s, a.y * s, a.z * s}; }
constexpr Vec3 operator*(double s, const Vec3& a) { return a * s; }
constexpr Vec3 operator/(const Vec3& a, double s) { return {a.x / s, a.y / s, a.z / s}; }
constexpr double dot(const Vec3& a, const Vec3& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
constexpr Vec3 cross(const Vec3& a, const Vec3& b) {
    return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
inline double length(const Vec3& a) { return std::sqrt(dot(a, a)); }
inline Vec3 unit(const Vec3& a) { return a / length(a); }

/// The direction into which an ideal mirror with unit normal `n` sends light travelling along `d`.
constexpr Vec3 mirrored(const Vec3& d, const Vec3& n) { return d - n * (2.0 * dot(d, n)); }

/// Some unit vector at right angles to the unit vector `n`.
inline Vec3 any_tangent(const Vec3& n) {
    return unit(std::abs(n.x) < 0.7 ? cross(n, Vec3{1, 0, 0}) : cross(n, Vec3{0, 1, 0}));
}

/// Linear light or reflectance in three bands.
struct Rgb {
    double r = 0.0;
    double g = 0.0;
    double b = 0.0;

    Rgb& operator+=(const Rgb& c) { return r += c.r, g += c.g, b += c.b, *this; }
};

constexpr Rgb operator+(const Rgb& a, const Rgb& b) { return {a.r + b.r, a.g + b.g, a.b + b.b}; }
constexpr Rgb operator*(const Rgb& a, double s) { return {a.r * s, a.g * s, a.b * s}; }
constexpr Rgb operator*(const Rgb& a, const Rgb& b) { return {a.r * b.r, a.g * b.g, a.b * b.b}; }
constexpr Rgb mix(const Rgb& a, const Rgb& b, double t) { return a * (1.0 - t) + b * t; }

struct Ray {
    Vec3 origin;
    Vec3 direction;  ///< unit length
};

/// A place on a surface's own parameters.
struct Vec2 {
    double u = 0.0;
    double v = 0.0;
};

}  // namespace darkbox::sim
