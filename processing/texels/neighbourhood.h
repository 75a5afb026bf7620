#pragma once

#include <opencv2/core.hpp>
#include <vector>

#include "processing/maps/maps.h"

namespace darkbox {

/// One row for each of `pixels` (all valid): the RGB of every pixel in the window x window square about it, in reading
/// order. A neighbour that is not valid or outside the image counts as the centre pixel itself, so nothing from beyond
/// the mask gets in. Thesis, texel clustering.
cv::Mat1f neighbourhood_vectors(const AlbedoMap& albedo, const std::vector<cv::Point>& pixels, int window);

}  // namespace darkbox
