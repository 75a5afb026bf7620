#pragma once

#include <opencv2/core.hpp>
#include <optional>
#include <string>
#include <vector>

#include "processing/calibration/calibration.h"
#include "rig/health/registration.h"

namespace darkbox {

/// More than this between the first and the last frame shows in normals and texture.
inline constexpr double most_movement_px = 0.3;

/// What happened between two frames of one light.
struct Movement {
    Shift object;               ///< all but the mirror balls
    std::optional<Shift> ball;  ///< the first one; none: there is none, or it shows too little

    /// "the object moved by 0.52 px (noise 0.01)": the ball, where there is one, tells object from camera.
    std::string words() const;
    /// Beyond the limit, and beyond its own noise.
    bool moved(double limit_px = most_movement_px) const;
};

/// Both frames in light above the dark frame; `usable`: 255 where neither clips. Balls in the pixels of these.
/// No value where the scene has too little to tell by.
std::optional<Movement> measure_movement(const cv::Mat1f& before, const cv::Mat1f& after, const cv::Mat1b& usable,
                                         const std::vector<Ball>& balls);

}  // namespace darkbox
