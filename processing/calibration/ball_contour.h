#pragma once

#include <Eigen/Core>
#include <opencv2/core.hpp>
#include <optional>
#include <vector>

#include "processing/calibration/circle_fit.h"

namespace darkbox {

/// Points measured on a ball's outline, and the circle through them.
struct BallContour {
    Circle circle;
    std::vector<cv::Point2d> points;  ///< within three spreads of the circle
    double spread_px = 0;             ///< standard deviation of the points' distances
    double support = 0;               ///< share of the outline with a point
    std::size_t rejected = 0;         ///< readings off the circle
    std::vector<double> sigma_px;     ///< of each point, across the outline; empty: all are alike
    /// By which all points may be off together, as a circle (x, y, radius; px^2); none: as their scatter tells.
    std::optional<Eigen::Matrix3d> shift_covariance;
};

/// The outline near `start`: along each radius, where the ball begins (see ProfileModel), to a fraction of a pixel. The
/// search narrows while the circle settles; then all radii are fitted together (see OutlineFit), where one mirrored
/// share explains them. `radiance` is linear.
BallContour measure_contour(const cv::Mat1f& radiance, const Circle& start);

/// The outline of a mask (255 on the ball, edges may be anti-aliased); the picture's border is not outline.
/// Throws InputError for a mask without a round region.
BallContour measure_mask(const cv::Mat1b& mask);

}  // namespace darkbox
