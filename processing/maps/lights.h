#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

namespace darkbox {

/// A distant light as the object sees it. Viewer frame: x right, y up, z from the object to the camera.
struct Light {
    std::string file;                    ///< basename of the frame it lit
    Eigen::Vector3d direction{0, 0, 1};  ///< unit vector from the object to the light
    Eigen::Vector3d intensity{1, 1, 1};  ///< R, G, B; relative, the mean over lights is the albedo's gauge
    double sigma_deg = 0.0;              ///< standard deviation of the direction per tangent axis; 0 = not known
    bool used = true;                    ///< false: no reliable reading; left out of every stage
};
using Lights = std::vector<Light>;

/// Directions of the used lights as rows of an n x 3 matrix.
Eigen::Matrix<double, Eigen::Dynamic, 3> direction_matrix(const Lights& lights);

/// Ratio of the largest to the smallest singular value of direction_matrix(); infinite for coplanar or fewer than
/// three.
double condition_number(const Lights& lights);

/// Throws InputError in words when photometric stereo has no unique solution: fewer than three used lights, or all of
/// them in one plane through the object (condition number above 1e3), or a direction that is not finite.
void require_solvable(const Lights& lights);

double angle_deg(const Eigen::Vector3d& a, const Eigen::Vector3d& b);

}  // namespace darkbox
