#pragma once

#include <opencv2/core.hpp>
#include <optional>
#include <string>
#include <vector>

#include "processing/calibration/calibration.h"

namespace darkbox {

/// What was read in one frame: the lamp's mirror image, or why there is none.
struct HighlightReading {
    std::optional<Highlight> highlight;
    std::string reason;   ///< in words, where there is no highlight
    int other_spots = 0;  ///< bright spots that were not taken for the lamp
};

/// What highlights are read from: the part of a frame of this size where the ball mirrors lamps, and some border.
cv::Rect mirror_box(const Ball& ball, cv::Size frame);

/// One part of every frame.
struct BallParts {
    cv::Rect box;  ///< in the frames
    std::vector<cv::Mat3f> frames;
};

/// The lamp's mirror image in each frame. What stands still over the frames (reflected windows, glow at the rim) is
/// taken away; of the bright spots that remain the strongest compact one is the lamp; its centroid is weighted by
/// radiance above half its height, with saturated pixels counting as full scale.
std::vector<HighlightReading> find_highlights(const std::vector<cv::Mat3f>& frames, const Ball& ball);
/// The same from every frame's mirror_box().
std::vector<HighlightReading> find_highlights(const BallParts& parts, const Ball& ball);

/// The thesis' reading: the brightest pixel of the ball (the middle of a plateau).
std::vector<HighlightReading> find_brightest(const BallParts& parts, const Ball& ball);

}  // namespace darkbox
