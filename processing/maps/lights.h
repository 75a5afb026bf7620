#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

namespace darkbox {

/// Where a lamp stands that is too near to light every point from one direction. Viewer frame, millimetres.
struct LampPosition {
    Eigen::Vector3d position_mm{0, 0, 1000};
    Eigen::Vector3d object_mm{0, 0, 0};  ///< the point at which Light::direction and Light::intensity hold
    Eigen::Matrix3d covariance_mm2 = Eigen::Matrix3d::Zero();  ///< of position_mm; zero = not known
};

/// A lamp's light as the object sees it. Viewer frame: x right, y up, z from the object to the camera.
struct Light {
    std::string file;                    ///< basename of the frame it lit
    Eigen::Vector3d direction{0, 0, 1};  ///< unit vector from the object (its centroid, for a near lamp) to the light
    Eigen::Vector3d intensity{1, 1, 1};  ///< R, G, B; relative, the mean over lights is the albedo's gauge
    bool used = true;                    ///< false: no reliable reading; left out of every stage
    Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();  ///< of `direction`, rad^2, rank two; zero = not known
    std::optional<LampPosition> near = {};                 ///< none: a distant light

    /// Standard deviation of the direction per tangent axis, degrees; 0 = not known.
    double sigma_deg() const;
};
using Lights = std::vector<Light>;

/// What a light sends to one point.
struct Incidence {
    Eigen::Vector3d direction{0, 0, 1};  ///< unit vector from the point to the light
    double falloff = 1;                  ///< irradiance there is Light::intensity times this
};
/// A distant light is the same everywhere; a near one falls off with the square of its distance, 1 at its object_mm.
/// `point_mm` in the viewer frame.
Incidence incidence(const Light& light, const Eigen::Vector3d& point_mm);

/// The same lamp with its direction, covariance and intensity as they are at `object_mm`; a distant light as it is. A
/// covariance is kept where the position's is not known.
Light held_at(Light light, const Eigen::Vector3d& object_mm);

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
