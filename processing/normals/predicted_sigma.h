#pragma once

#include <Eigen/Core>

#include "processing/normals/light_field.h"
#include "processing/normals/pixel_solver.h"

namespace darkbox {

// How far a normal may be off: the standard deviation, in degrees, along one axis tangent to the sphere of normals, the
// mean of two axes taken in variance. An angle between normals that are off by a round error of deviation s has
// Rayleigh's distribution: its median is 1.177 s. First-order propagation of three things through the least squares of
// a pixel: the sensor's noise, the directions' covariance of lights where known, and what the pixel's own residual
// shows beyond both. A law that the material does not follow leaves a residual too small to tell how far it bends
// normals: the prediction does not know that error.

/// For a fit with weights, at the pixel whose samples the solver holds.
float predicted_sigma_deg(const PixelFit& fit, const PixelSolver& solver, const LightField& field);

/// What a residual shows beyond the variance that was expected. By chance alone it varies by a factor of
/// 1 + sqrt(2 / freedom) or so: up to 1 + `chance_factor` times that root nothing is shown.
inline constexpr float chance_factor = 2.0F;

}  // namespace darkbox
