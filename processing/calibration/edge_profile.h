#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

namespace darkbox {

/// An outline crossed by a profile.
struct ProfileEdge {
    double offset = 0;    ///< px outwards from the profile's middle
    double height = 0;    ///< root mean square of what the edge explains of the profile
    double residual = 0;  ///< sum of squares that it does not
};

/// Brightness profiles along a ball's radii, all with the same steps; the first value lies innermost.
struct Profiles {
    int half = 0;  ///< samples on each side of the middle
    double step_px = 0.5;
    std::vector<Eigen::VectorXd> values;
};

/// What all profiles of one outline have in common.
struct EdgeShape {
    double blur_px = 1;  ///< standard deviation: lens, pixels and whatever smoothed the picture
    /// Radiance just inside the outline over that just outside; none: every profile has its own.
    std::optional<double> mirrored_share;
};

/// Finds where a mirror ball begins on a profile.
/// Outside is one radiance. At the outline the ball mirrors what is just behind it, dimmer by a share that is the same
/// all around; d px within it mirrors what lies sqrt(8 d / R) radians further, whose radiance there is that share plus
/// a multiple of sqrt(d) plus one of d: steepest at the outline, which draws a steepest-gradient edge off it. Level,
/// root and line, all blurred, are fitted by linear least squares at every offset; the offset with the least residual
/// is the outline.
class ProfileModel {
public:
    /// Offsets within `reach_px`.
    ProfileModel(int half, double step_px, const EdgeShape& shape, double reach_px);

    /// No value where the best offset lies at the end of the reach.
    std::optional<ProfileEdge> fit(const Eigen::VectorXd& profile) const;
    /// The least sum of squares that any offset leaves.
    double least_residual(const Eigen::VectorXd& profile) const;

private:
    std::vector<double> residuals(const Eigen::VectorXd& profile) const;

    bool tied_ = false;
    std::vector<double> offsets_;
    std::vector<Eigen::MatrixXd> explained_;  ///< by offset: orthonormal rows that span the model's profiles
};

/// The shape that explains the profiles best. One share for all is taken where it explains them about as well as a
/// share of each profile's own would: it settles where the edge lies when what is mirrored changes fast, but does not
/// hold where the ball touches other things.
EdgeShape shape_of_edge(const Profiles& profiles, double reach_px);

}  // namespace darkbox
