#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <vector>

#include "sim/geometry.h"

namespace darkbox::sim {

/// One vertex of a smooth surface, with its exact normal and parameters.
struct Vertex {
    Vec3 position;  ///< mm
    Vec3 normal;    ///< unit length, outward
    Vec2 uv;        ///< tiles
    Vec3 position_du;
    Vec3 position_dv;
};

/// Triangles of a smooth surface; normals and parameters are interpolated between the vertices.
struct TriangleMesh {
    std::vector<Vertex> vertices;
    std::vector<std::array<std::uint32_t, 3>> triangles;  ///< counter-clockwise seen from outside
    int period_u = 0;                                     ///< tiles; 0 = does not close
    int period_v = 0;
    /// The exact unit normal near a point of the surface; empty where interpolation has to do.
    std::function<Vec3(const Vec3&)> exact_normal;
};

/// A smooth surface over the unit square.
struct ParametricSurface {
    std::function<Vec3(double, double)> position;
    double tiles_u = 1.0;  ///< tiles over the unit interval
    double tiles_v = 1.0;
    bool closed_u = false;  ///< position(0, v) == position(1, v)
    bool closed_v = false;
};

/// Samples the surface on a grid of cells. Normals follow from the derivatives, position_du x position_dv outward.
TriangleMesh tessellated(const ParametricSurface& surface, int cells_u, int cells_v);

/// A torus about the z axis through `centre`.
struct Torus {
    Vec3 centre;
    double ring_mm = 42.0;
    double tube_mm = 20.0;
};
TriangleMesh torus_mesh(const Torus& torus);

/// A rectangle about the origin, raised by height(x, y) in mm towards the camera.
struct HeightField {
    double width_mm = 104.0;
    double height_mm = 98.0;
    std::function<double(double, double)> height;
};
TriangleMesh height_field_mesh(const HeightField& field, int cells);

/// The mesh after x -> rotation * x + shift, where rotation is given by its three columns.
struct Pose {
    Vec3 x_axis{1, 0, 0};
    Vec3 y_axis{0, 1, 0};
    Vec3 z_axis{0, 0, 1};
    double scale = 1.0;
    Vec3 shift;
};
TriangleMesh posed(TriangleMesh mesh, const Pose& pose);

}  // namespace darkbox::sim
