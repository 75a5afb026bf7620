#pragma once

#include <Eigen/Core>
#include <functional>
#include <optional>
#include <string>

#include "processing/maps/lights.h"

namespace darkbox {

/// One standard deviation of a light's direction as a plot shows it, in the plot's units.
struct Ellipse {
    double major = 0, minor = 0;  ///< semi-axes
    double angle_deg = 0;         ///< of the major axis, from the plot's x to its y axis
};

/// Where a plot shows a direction.
using Mapping = std::function<Eigen::Vector2d(const Eigen::Vector3d&)>;

/// No value for a light whose covariance is not known.
std::optional<Ellipse> uncertainty(const Light& light, const Mapping& mapping);

/// 1, 2, 5, 10...: the factor that makes most of these ellipses large enough to see; 1 when they are, or for none.
double magnification_for(const Lights& lights, const Mapping& mapping, double wanted_size);

/// An SVG element of class `sigma`; empty for no ellipse.
std::string ellipse_svg(const std::optional<Ellipse>& ellipse, const Eigen::Vector2d& at, double magnification);

}  // namespace darkbox
