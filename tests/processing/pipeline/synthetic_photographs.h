#pragma once

#include <filesystem>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "processing/maps/lights.h"

namespace darkbox::test {

/// Six lights around the camera's axis and one above it.
Lights lamp_ring();

/// A Lambert ball of two colours under each light, in the middle of a black 96x80 picture; its radius is 30 pixels.
cv::Mat3f lambert_ball(const Light& light);
cv::Mat1b lambert_ball_mask();

/// Written as 16-bit PNGs frame1.png...frame7.png into `folder`.
void write_photographs(const std::filesystem::path& folder, const Lights& lights);

}  // namespace darkbox::test
