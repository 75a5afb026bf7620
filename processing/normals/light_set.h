#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <vector>

#include "processing/maps/lights.h"

namespace darkbox {

/// One used light, in the precision the pixel loops work in.
struct SolverLight {
    std::size_t image = 0;          ///< its photograph's place in the stack
    Eigen::Vector3f direction;      ///< unit vector to the light
    std::array<float, 3> gain{};    ///< 1 / intensity, R, G, B: brings a photograph to a light of intensity 1
    Eigen::Vector3f pseudo_column;  ///< its column of the pseudo-inverse of all directions
};

/// The used lights with all that depends on them alone. Thread-safe once made.
struct LightSet {
    std::vector<SolverLight> lights;
    double condition_number = 0;  ///< of all directions together

    /// Throws InputError as require_solvable() does, and for an intensity that is not a positive number.
    static LightSet from(const Lights& lights);
};

}  // namespace darkbox
