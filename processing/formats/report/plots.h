#pragma once

#include <string>
#include <vector>

#include "processing/formats/report/report.h"

namespace darkbox {

// Inline SVG; colours come from the page's style.

/// Lights as the camera sees them come: the middle is the camera's own direction, the rim 30, 60 or 90 degrees
/// off it, x to the right and y up; angles from the axis are to scale. Ellipses show one standard deviation, magnified.
std::string light_plot(const Lights& lights);
double light_plot_magnification(const Lights& lights);

/// The ball's picture with its outline, every highlight, and around it one standard deviation of the light's direction
/// as the ball mirrors it, magnified. `lights` are found by the highlights' names.
std::string ball_plot(const ReportBall& ball, const Lights& lights);
double ball_plot_magnification(const ReportBall& ball, const Lights& lights);

/// Shares of samples over equal bins of 0...1, on a square-root scale so that small shares are seen.
std::string histogram_plot(const std::vector<double>& shares);

}  // namespace darkbox
