#include "sim/teapot.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace darkbox::sim {
namespace {

/// Newell's body, lid and bottom are quarters of revolution: control points (r, z) of cubic Bezier profiles, outward on
/// the right when walked in this order.
struct ProfilePoint {
    double r, z;
};
using Profile = std::vector<std::array<ProfilePoint, 4>>;

const Profile body_profile{{{{1.5, 0.15}, {1.5, 0.225}, {2.0, 0.45}, {2.0, 0.9}}},
                           {{{2.0, 0.9}, {2.0, 1.35}, {1.75, 1.875}, {1.5, 2.4}}},
                           {{{1.5, 2.4}, {1.4375, 2.53125}, {1.3375, 2.53125}, {1.4, 2.4}}}};
const Profile lid_profile{{{{1.3, 2.4}, {1.3, 2.55}, {0.4, 2.55}, {0.2, 2.7}}},
                          {{{0.2, 2.7}, {0.0, 2.85}, {0.8, 3.15}, {0.0, 3.15}}}};
const Profile ring_profile{{{{1.4, 2.4}, {1.3667, 2.4}, {1.3333, 2.4}, {1.3, 2.4}}}};
const Profile bottom_profile{{{{0.0, 0.0}, {1.425, 0.0}, {1.5, 0.075}, {1.5, 0.15}}}};

/// Half of a tube (its side of negative y): rows along the tube, columns across it.
using HalfPatch = std::array<std::array<Vec3, 4>, 4>;

const std::array<HalfPatch, 2> handle_patches{{
    {{{{{-1.6, 0, 2.025}, {-1.6, -0.3, 2.025}, {-1.5, -0.3, 2.25}, {-1.5, 0, 2.25}}},
      {{{-2.3, 0, 2.025}, {-2.3, -0.3, 2.025}, {-2.5, -0.3, 2.25}, {-2.5, 0, 2.25}}},
      {{{-2.7, 0, 2.025}, {-2.7, -0.3, 2.025}, {-3.0, -0.3, 2.25}, {-3.0, 0, 2.25}}},
      {{{-2.7, 0, 1.8}, {-2.7, -0.3, 1.8}, {-3.0, -0.3, 1.8}, {-3.0, 0, 1.8}}}}},
    {{{{{-2.7, 0, 1.8}, {-2.7, -0.3, 1.8}, {-3.0, -0.3, 1.8}, {-3.0, 0, 1.8}}},
      {{{-2.7, 0, 1.575}, {-2.7, -0.3, 1.575}, {-3.0, -0.3, 1.35}, {-3.0, 0, 1.35}}},
      {{{-2.5, 0, 1.125}, {-2.5, -0.3, 1.125}, {-2.65, -0.3, 0.9375}, {-2.65, 0, 0.9375}}},
      {{{-2.0, 0, 0.9}, {-2.0, -0.3, 0.9}, {-1.9, -0.3, 0.6}, {-1.9, 0, 0.6}}}}},
}};
const std::array<HalfPatch, 2> spout_patches{{
    {{{{{1.7, 0, 1.425}, {1.7, -0.66, 1.425}, {1.7, -0.66, 0.6}, {1.7, 0, 0.6}}},
      {{{2.6, 0, 1.425}, {2.6, -0.66, 1.425}, {3.1, -0.66, 0.825}, {3.1, 0, 0.825}}},
      {{{2.3, 0, 2.1}, {2.3, -0.25, 2.1}, {2.4, -0.25, 2.025}, {2.4, 0, 2.025}}},
      {{{2.7, 0, 2.4}, {2.7, -0.25, 2.4}, {3.3, -0.25, 2.4}, {3.3, 0, 2.4}}}}},
    {{{{{2.7, 0, 2.4}, {2.7, -0.25, 2.4}, {3.3, -0.25, 2.4}, {3.3, 0, 2.4}}},
      {{{2.8, 0, 2.475}, {2.8, -0.25, 2.475}, {3.525, -0.25, 2.49375}, {3.525, 0, 2.49375}}},
      {{{2.9, 0, 2.475}, {2.9, -0.15, 2.475}, {3.45, -0.15, 2.5125}, {3.45, 0, 2.5125}}},
      {{{2.8, 0, 2.4}, {2.8, -0.15, 2.4}, {3.2, -0.15, 2.4}, {3.2, 0, 2.4}}}}},
}};

std::array<double, 4> bernstein(double t) {
    const double s = 1.0 - t;
    return {s * s * s, 3.0 * s * s * t, 3.0 * s * t * t, t * t * t};
}

/// The piece of a chain of `count` curves that holds t in [0, 1], and the parameter within it.
struct Piece {
    int index = 0;
    double t = 0.0;
};
Piece piece_at(int count, double t) {
    const double scaled = t * count;
    const int index = std::min(static_cast<int>(scaled), count - 1);
    return {index, scaled - index};
}

/// A surface of revolution about z: u turns, v walks along the profile.
TriangleMesh revolved(const Profile& profile, double tiles_u, double tiles_v) {
    ParametricSurface surface;
    surface.position = [profile](double u, double v) {
        const Piece piece = piece_at(static_cast<int>(profile.size()), v);
        const auto weights = bernstein(piece.t);
        ProfilePoint p{};
        for (std::size_t i = 0; i < 4; ++i) {
            p.r += weights[i] * profile[piece.index][i].r;
            p.z += weights[i] * profile[piece.index][i].z;
        }
        const double angle = 2.0 * std::numbers::pi * u;
        return Vec3{p.r * std::cos(angle), p.r * std::sin(angle), p.z};
    };
    surface.tiles_u = tiles_u;
    surface.tiles_v = tiles_v;
    surface.closed_u = true;
    return tessellated(surface, 256, 64 * static_cast<int>(profile.size()));
}

Vec3 on_patch(const HalfPatch& patch, double along, double across) {
    const auto row_weights = bernstein(along);
    const auto column_weights = bernstein(across);
    Vec3 p;
    for (std::size_t i = 0; i < 4; ++i)
        for (std::size_t j = 0; j < 4; ++j) p += patch[i][j] * (row_weights[i] * column_weights[j]);
    return p;
}

/// A tube from two half patches and their mirror images: u turns around it, v walks along it.
TriangleMesh tube(const std::array<HalfPatch, 2>& patches, double tiles_u, double tiles_v) {
    ParametricSurface surface;
    surface.position = [patches](double u, double v) {
        const double turned = u - std::floor(u);
        const bool mirrored_half = turned > 0.5;
        const Piece piece = piece_at(2, v);
        Vec3 p = on_patch(patches[piece.index], piece.t, mirrored_half ? 2.0 - 2.0 * turned : 2.0 * turned);
        if (mirrored_half) p.y = -p.y;
        return p;
    };
    surface.tiles_u = tiles_u;
    surface.tiles_v = tiles_v;
    surface.closed_u = true;
    return tessellated(surface, 96, 128);
}

}  // namespace

std::vector<TriangleMesh> teapot_parts() {
    return {revolved(body_profile, 12, 8),   revolved(lid_profile, 8, 6), revolved(ring_profile, 12, 0.5),
            revolved(bottom_profile, 12, 3), tube(handle_patches, 2, 10), tube(spout_patches, 3, 8)};
}

}  // namespace darkbox::sim
