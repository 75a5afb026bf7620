#pragma once

#include <opencv2/core.hpp>
#include <optional>
#include <vector>

#include "processing/calibration/circle_fit.h"

namespace darkbox {

/// A lamp in front of the object (z > 0) is mirrored within sin 45 deg = 0.707 of the ball's radius; a little more is
/// looked at. What shines further out is the rim, which mirrors what stands behind the ball.
constexpr double mirror_zone = 0.75;

/// The one small, bright spot inside the circle, as a mirror shows a lamp; in each image, in radii from the circle's
/// centre. `images` are luminance, one per lamp.
std::vector<std::optional<cv::Point2d>> find_glints(const std::vector<cv::Mat1f>& images, const Circle& circle);

/// Share of images with a glint; 0 when the glint stands still in all of them.
double glint_share(const std::vector<std::optional<cv::Point2d>>& glints);

/// Where an image is far brighter than most others at the same place, as glints are, and what leaves its shadow. One
/// mask per image, 255 there.
std::vector<cv::Mat1b> flashes(const std::vector<cv::Mat1f>& images);

}  // namespace darkbox
