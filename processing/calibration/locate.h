#pragma once

#include <Eigen/Core>
#include <opencv2/core.hpp>
#include <optional>
#include <vector>

#include "processing/calibration/ball_photographs.h"
#include "processing/calibration/calibration.h"

namespace darkbox {

/// A ball in the picture and what is known of its outline.
struct LocatedBall {
    Ball ball;
    std::vector<cv::Point2d> contour;
    std::size_t rejected = 0;                         ///< readings off the outline
    double contour_spread_px = 0;                     ///< standard deviation of the contour's points
    std::vector<double> contour_sigma_px;             ///< of each point; empty: all are alike
    std::optional<Eigen::Matrix3d> shift_covariance;  ///< see BallContour
    std::optional<double> sigma_px;                   ///< of the circle itself, where the contour alone does not decide
};

/// The balls given by hand, in the mask, or found, best first.
/// Throws InputError: none is found, one lies outside the picture, two are the same, the mask does not fit.
std::vector<LocatedBall> locate_balls(BallPhotographs& photographs, const CalibrationOptions& options);

}  // namespace darkbox
