#pragma once

#include <Eigen/Core>
#include <functional>
#include <optional>
#include <vector>

#include "processing/calibration/circle_fit.h"
#include "processing/calibration/edge_profile.h"

namespace darkbox {

/// Brightness along the radius of a circle in one direction (radians, clockwise in the picture), `half` steps of
/// `step_px` to both sides; empty where it leaves the picture.
using ReadProfile = std::function<Eigen::VectorXd(const Circle& circle, double angle, int half, double step_px)>;

/// A ball's outline fitted to the profiles of all its directions at once.
struct OutlineFit {
    Circle circle;
    EdgeShape shape;
    std::vector<double> offset_px;  ///< of each profile's own edge from the circle, outwards; one per angle
    std::vector<double> sigma_px;   ///< of each offset, from what the fit leaves of its profile
    /// Of the circle's x, y and radius, px^2. Sectors of the outline are taken as independent, whatever happens
    /// within one (the sandwich estimator of clustered data, Liang and Zeger 1986), and how far the circle moves
    /// between two and three terms of the mirrored radiance stands for what no number of terms would hold.
    Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
};

/// One circle (bent to an ellipse where the camera is near), one blur and one mirrored share explain all profiles;
/// each has its own radiance outside and its own mirrored radiance within: that share of it plus a polynomial in how
/// far beyond the straight view the mirrored ray points, phi = 2 arccos(1 - d / R) at depth d. Level and polynomial are
/// eliminated from each profile (variable projection, Golub and Pereyra 1973); Gauss-Newton on what they leave, with
/// profiles weighed down that leave much. Where each profile finds its edge alone, share and offset trade against each
/// other: together, the circle is better by several times.
/// No value where the profiles do not settle the circle within a pixel of `start`.
std::optional<OutlineFit> fit_outline(const ReadProfile& read, const std::vector<double>& angles, const Circle& start,
                                      const EdgeShape& shape);

}  // namespace darkbox
