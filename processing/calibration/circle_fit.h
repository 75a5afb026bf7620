#pragma once

#include <opencv2/core.hpp>
#include <optional>
#include <vector>

namespace darkbox {

struct Circle {
    double x = 0;
    double y = 0;
    double radius = 0;

    /// Signed distance of a point to the circle: positive outside.
    double distance(const cv::Point2d& p) const;
};

/// Least squares on the squared radius (Kasa 1976), in coordinates centred on the points. No value for fewer than three
/// points or points on a line.
std::optional<Circle> fit_circle_algebraic(const std::vector<cv::Point2d>& points);

/// Least squares on the distances with Cauchy weights of the given scale (px), from a start: Gauss-Newton, iterated to
/// rest. Returns the start where the points do not determine a circle.
Circle fit_circle_robust(const std::vector<cv::Point2d>& points, const Circle& start, double scale);

/// Median absolute distance to the circle times 1.4826: the standard deviation when most points are good.
double robust_spread(const std::vector<cv::Point2d>& points, const Circle& circle);

}  // namespace darkbox
