#pragma once

#include <filesystem>
#include <optional>
#include <vector>

#include "processing/calibration/ball_photographs.h"

namespace darkbox {

/// How sharp the first ball is, by edge_width_px() over what is seen around and in it, in the mean of all frames,
/// without what any of them clips. A ball in its place shows the same edges in every recalibration, so that a focus
/// that creeps shows. No value where the ball is too small or too dark to tell.
std::optional<double> ball_blur_px(BallPhotographs& photographs, const std::vector<Ball>& balls);

/// What the session's calibration found of it; no value where it says nothing, or does not read.
std::optional<double> stored_blur_px(const std::filesystem::path& session);

}  // namespace darkbox
