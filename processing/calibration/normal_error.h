#pragma once

#include <Eigen/Core>
#include <vector>

namespace darkbox {

// The one noise model that light_geometry() reports and plan_rig() minimises. A photograph under light L of a surface
// with g = albedo * normal shows g.L plus noise of standard deviation `noise`; least squares over the lights that reach
// the normal has the information matrix M = sum L L^T, and g the covariance noise^2 M^-1 (Drbohlav and Chantler 2005,
// "On optimal light configurations in photometric stereo", ICCV, section 2). What of it lies across g turns the normal.

/// Noise that predicted errors are given for: 1 % of the radiance of a surface that faces its light.
inline constexpr double reference_noise = 0.01;

/// Unit normals evenly over the visible hemisphere, z > 0, by Fibonacci's spiral.
std::vector<Eigen::Vector3d> visible_normals(int count);

/// Standard deviation of the angle of a normal (albedo 1, both tangent axes together), degrees, from M. Each component
/// of g is known to within 1 beforehand, so that a normal that no light determines counts with about a radian instead
/// of infinity.
double normal_error_deg(const Eigen::Matrix3d& information, const Eigen::Vector3d& normal, double noise);

/// Whether lights of this information determine normals: under `reference_noise` no axis of g is off by more than a
/// tenth (about six degrees).
bool determines_normals(const Eigen::Matrix3d& information);

}  // namespace darkbox
