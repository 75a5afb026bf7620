#pragma once

#include <opencv2/core.hpp>
#include <vector>

#include "processing/calibration/circle_fit.h"

namespace darkbox {

/// A bright spot's pixels with what surrounds it, and how a round lamp looks there: a mirror ball shows it as an
/// ellipse, narrower towards the rim by 1 - |n_xy|^2 (n the ball's normal there) than along the rim.
struct SpotPatch {
    std::vector<cv::Point2d> at;  ///< pixel centres, the fringe of half-covered pixels included
    std::vector<double> value;    ///< radiance there; what saturates is at full scale
    double background = 0;        ///< radiance around the spot
    double top = 0;               ///< radiance at its brightest
    double noise = 0;             ///< standard deviation of a value around the spot
    /// Of each value, as its colours disagree: light itself is noisy, and a spot has more of it than its surroundings.
    std::vector<double> grain;
    bool clipped = false;      ///< `top` is the sensor's full scale
    cv::Point2d narrow{1, 0};  ///< unit direction of the ellipse's short axis
    double roundness = 1;      ///< short axis over long axis
};

struct SpotMeasure {
    cv::Point2d at;
    double sigma_px = 0;    ///< standard deviation per axis
    double radius_px = 0;   ///< of the circle of the same area
    bool windowed = false;  ///< `at` is a centroid in a Gaussian window, not of the whole spot
};

/// Where a spot is. One below full scale: its centroid in a Gaussian window about twice as wide. A saturated
/// one holds its place in its border alone, so an ellipse of the expected shape is fitted to that border; where flare
/// has given it another shape, the centroid is the better guess, and less certain. The standard deviation holds noise,
/// what pixels hide of a small spot's place, and how far the whole spot and its core disagree about it.
SpotMeasure measure_spot(const SpotPatch& patch);

}  // namespace darkbox
