#pragma once

#include <opencv2/core.hpp>

#include "processing/maps/photo_source.h"

namespace darkbox {

// One pixel of a photograph's rows, for loops that visit few of them: the bits that radiance_of() and clipped_of()
// give.

cv::Vec3f radiance_at(const PhotoRows& rows, int row, int column);
bool clipped_at(const PhotoRows& rows, int row, int column);

}  // namespace darkbox
