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

/// Finds where a mirror ball begins on brightness profiles taken along its radii, all with the same steps.
/// Outside is one radiance. Inside, the ball mirrors what stands beside it: at the outline, what is just behind it, and
/// d px within, what lies sqrt(8 d / R) radians further; its radiance there is a step plus a multiple of sqrt(d), which
/// is steepest at the outline and draws a steepest-gradient edge off it. Step and root, both blurred, are fitted by
/// linear least squares at every offset; the offset with the least residual is the outline.
class ProfileModel {
public:
    /// `half` samples on each side of the middle, `step_px` apart, blurred by `blur_px`; offsets within `reach_px`.
    ProfileModel(int half, double step_px, double blur_px, double reach_px);

    /// No value where the best offset lies at the end of the reach.
    std::optional<ProfileEdge> fit(const std::vector<double>& profile) const;

private:
    std::vector<double> offsets_;
    std::vector<Eigen::MatrixXd> explained_;  ///< by offset: orthonormal rows that span the model's profiles
};

}  // namespace darkbox
