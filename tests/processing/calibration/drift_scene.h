#pragma once

#include <Eigen/Geometry>
#include <random>

#include "processing/calibration/drift.h"

namespace darkbox::test {

/// A dome of lamps "lamp-1", "lamp-2", ... of the rig "dome", each known to `sigma_deg` per tangent axis.
RigLights dome(int lamps, double sigma_deg = 0.1);

/// Every direction turned; the covariances turn along.
RigLights turned(RigLights rig, const Eigen::AngleAxisd& rotation);
inline Eigen::AngleAxisd knock_of_deg(double degrees) {
    return {degrees * M_PI / 180, Eigen::Vector3d(1, 2, 0.5).normalized()};
}

/// The direction moved by this angle, tilted down from the view axis.
void move_lamp(RigLights& rig, std::size_t lamp, double degrees);
void swap_lamps(RigLights& rig, std::size_t a, std::size_t b);

/// As measured: each direction off by what its covariance says.
RigLights measured(RigLights rig, std::mt19937& random);

const LampDrift& lamp_of(const Drift& drift, const std::string& name);
/// Names of the lamps with this finding.
std::vector<std::string> found(const Drift& drift, LampFinding finding);

}  // namespace darkbox::test
