#pragma once

#include <opencv2/core.hpp>
#include <vector>

namespace darkbox {

/// How well a measured outline is known.
struct ContourNoise {
    double sigma_px = 0.3;  ///< standard deviation of one point, across the outline
    /// Neighbouring points share pixels and shading, and so their errors; this many of them are worth one.
    double readings_per_independent = 1;

    /// Of one point when all are taken as independent: makes a least-squares fit's covariance honest.
    double effective_sigma_px() const;
};

/// From the points' distances to the fitted outline. What moves the fit is the errors' slow part around the outline
/// (waves 0 and 1: its size and its place). The fit swallows that, but the next slowest waves, which no circle can
/// follow, show how strong it is: `readings_per_independent` is the power of waves 2 to 5 over that of white noise.
ContourNoise contour_noise(const std::vector<cv::Point2d>& points, const std::vector<double>& distances_px,
                           const cv::Point2d& centre);

/// Standard deviation told by the median of the absolute values, which strays do not move.
double robust_sigma(std::vector<double> values);

}  // namespace darkbox
