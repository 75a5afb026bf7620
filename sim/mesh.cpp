#include "sim/mesh.h"

#include <algorithm>
#include <numbers>

namespace darkbox::sim {
namespace {

constexpr double tile_length_mm = 20.0;
constexpr double tile_height_mm = 10.0;

/// The difference quotient of f at x within [0, 1], one-sided at open ends.
template <class F>
Vec3 derivative(const F& f, double x, bool closed) {
    constexpr double h = 1e-5;
    const double low = closed ? x - h : std::max(0.0, x - h);
    const double high = closed ? x + h : std::min(1.0, x + h);
    return (f(high) - f(low)) / (high - low);
}

Vertex vertex_at(const ParametricSurface& s, double u, double v) {
    const Vec3 du = derivative([&](double x) { return s.position(x, v); }, u, s.closed_u);
    const Vec3 dv = derivative([&](double x) { return s.position(u, x); }, v, s.closed_v);
    Vec3 outward = cross(du, dv);
    if (length(outward) < 1e-6 * (dot(du, du) + dot(dv, dv))) {
        // At a pole one derivative vanishes; just beside it the surface has the same normal.
        const double inner_u = std::clamp(u, 1e-3, 1.0 - 1e-3);
        const double inner_v = std::clamp(v, 1e-3, 1.0 - 1e-3);
        outward = cross(derivative([&](double x) { return s.position(x, inner_v); }, inner_u, s.closed_u),
                        derivative([&](double x) { return s.position(inner_u, x); }, inner_v, s.closed_v));
    }
    return {s.position(u, v), unit(outward), {u * s.tiles_u, v * s.tiles_v}, du / s.tiles_u, dv / s.tiles_v};
}

}  // namespace

TriangleMesh tessellated(const ParametricSurface& surface, int cells_u, int cells_v) {
    TriangleMesh mesh;
    mesh.vertices.reserve(static_cast<std::size_t>(cells_u + 1) * (cells_v + 1));
    for (int j = 0; j <= cells_v; ++j)
        for (int i = 0; i <= cells_u; ++i)
            mesh.vertices.push_back(vertex_at(surface, double(i) / cells_u, double(j) / cells_v));
    const auto index = [&](int i, int j) { return static_cast<std::uint32_t>(j * (cells_u + 1) + i); };
    for (int j = 0; j < cells_v; ++j)
        for (int i = 0; i < cells_u; ++i) {
            mesh.triangles.push_back({index(i, j), index(i + 1, j), index(i + 1, j + 1)});
            mesh.triangles.push_back({index(i, j), index(i + 1, j + 1), index(i, j + 1)});
        }
    if (surface.closed_u) mesh.period_u = static_cast<int>(surface.tiles_u);
    if (surface.closed_v) mesh.period_v = static_cast<int>(surface.tiles_v);
    return mesh;
}

TriangleMesh torus_mesh(const Torus& torus) {
    constexpr double turn = 2.0 * std::numbers::pi;
    ParametricSurface surface;
    surface.position = [torus](double u, double v) {
        const double radius = torus.ring_mm + torus.tube_mm * std::cos(turn * v);
        return torus.centre +
               Vec3{radius * std::cos(turn * u), radius * std::sin(turn * u), torus.tube_mm * std::sin(turn * v)};
    };
    surface.tiles_u = std::round(turn * torus.ring_mm / tile_length_mm);
    surface.tiles_v = 2.0 * std::round(turn * torus.tube_mm / (2.0 * tile_height_mm));  // even: running bond closes
    surface.closed_u = surface.closed_v = true;
    TriangleMesh mesh = tessellated(surface, 384, 192);
    mesh.exact_normal = [torus](const Vec3& p) {
        const Vec3 d = p - torus.centre;
        const double flat = std::hypot(d.x, d.y);
        return unit(d - Vec3{d.x / flat, d.y / flat, 0.0} * torus.ring_mm);
    };
    return mesh;
}

TriangleMesh height_field_mesh(const HeightField& field, int cells) {
    ParametricSurface surface;
    surface.position = [field](double u, double v) {
        const double x = (u - 0.5) * field.width_mm;
        const double y = (v - 0.5) * field.height_mm;
        return Vec3{x, y, field.height(x, y)};
    };
    surface.tiles_u = field.width_mm / tile_length_mm;
    surface.tiles_v = field.height_mm / tile_height_mm;
    return tessellated(surface, cells, cells);
}

TriangleMesh posed(TriangleMesh mesh, const Pose& pose) {
    const auto turned = [&](const Vec3& p) { return pose.x_axis * p.x + pose.y_axis * p.y + pose.z_axis * p.z; };
    for (Vertex& vertex : mesh.vertices) {
        vertex.position = turned(vertex.position) * pose.scale + pose.shift;
        vertex.normal = turned(vertex.normal);
        vertex.position_du = turned(vertex.position_du) * pose.scale;
        vertex.position_dv = turned(vertex.position_dv) * pose.scale;
    }
    mesh.exact_normal = nullptr;
    return mesh;
}

}  // namespace darkbox::sim
