#pragma once

#include <opencv2/core.hpp>
#include <optional>
#include <string>
#include <vector>

#include "acquisition/frame/progress.h"
#include "acquisition/session/session.h"
#include "processing/maps/maps.h"

namespace darkbox {

/// The lit frames as linear radiance: decoded, linearised by each frame's transfer curve, black level or the mean
/// lamps-off frame of the same exposure and gain subtracted (never both). The mask is data/masks/mask.png cut at half,
/// else found by automatic_mask(). Throws InputError for no lit frame, frames that cannot be read, or sizes that
/// differ.
PhotoStack load_stack(const Session& session, const WorkContext& work = {});

struct BallFrames {
    std::vector<cv::Mat3f> frames;   ///< linear radiance, one per lit frame
    std::vector<std::string> files;  ///< the lit frames' basenames: what their lights will be called
    bool separate = false;           ///< a capture of its own; else the ball is in view beside the object
};
/// Frames of kind ball where there are any, else the lit frames.
BallFrames load_ball_frames(const Session& session, const WorkContext& work = {});

/// Pixels lit well above the background in the brightest of all images (Otsu's threshold), largest connected part,
/// holes filled, without the discs (x, y, radius in pixels) to be left out. Throws InputError when nothing is lit.
cv::Mat1b automatic_mask(const std::vector<cv::Mat3f>& images, const std::vector<cv::Vec3d>& without);

}  // namespace darkbox
