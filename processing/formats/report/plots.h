#pragma once

#include <string>
#include <vector>

#include "processing/formats/report/report.h"

namespace darkbox {

// Inline SVG; colours come from the page's style.

/// Lights as the camera sees them come: the middle is the camera's own direction, the rim is at right angles to it, x
/// to the right and y up. Circles show ten standard deviations.
std::string light_plot(const Lights& lights);

/// The ball's picture with its outline and every highlight.
std::string ball_plot(const ReportBall& ball);

/// Shares of samples over equal bins of 0...1, on a square-root scale so that small shares are seen.
std::string histogram_plot(const std::vector<double>& shares);

}  // namespace darkbox
