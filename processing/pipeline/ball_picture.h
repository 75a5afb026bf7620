#pragma once

#include <opencv2/core.hpp>
#include <vector>

#include "processing/calibration/calibration.h"

namespace darkbox {

/// The part of a picture around the balls, for looking at.
struct BallView {
    cv::Mat3b image;     ///< brightest value of every frame, R, G, B
    double scale = 1;    ///< view pixels per frame pixel
    cv::Point2d origin;  ///< frame pixel at the view's top left
    cv::Point2d in_view(double u, double v) const {
        return {(u - origin.x + 0.5) * scale - 0.5, (v - origin.y + 0.5) * scale - 0.5};
    }
};

/// Cut out with a margin and magnified so that small balls can be judged. `brightest`: each channel's greatest value
/// over the frames.
BallView view_of_balls(const cv::Mat3f& brightest, const std::vector<Ball>& balls);

/// Outline and highlights drawn: calibration/ball.png.
cv::Mat3b draw_balls(const BallView& view, const Calibration& calibration);

}  // namespace darkbox
