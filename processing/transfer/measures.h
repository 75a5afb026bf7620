#pragma once

#include <opencv2/core.hpp>

#include "processing/maps/maps.h"

namespace darkbox {

// Figures that tell how good a transferred texture is; see TransferResult. Those that look for neighbours take a
// sampled grid of target pixels, so that they cost little next to the synthesis itself.

/// The 95th percentile over target normals of the angle to the nearest of the source's, degrees.
double coverage_deg(const NormalMap& source, const NormalMap& target);

/// Of all pairs of valid target pixels side by side or one above the other, the share whose source coordinates lie so
/// too. 1 where there is no pair.
double coherence(const cv::Mat2i& coordinates);

/// RMS difference of the target's window x window patches to the nearest patch of the source, 8-bit units: `white`
/// counts 255. Only patches that are valid all over; 0 where there is none.
double patch_energy(const AlbedoMap& source, const AlbedoMap& target, int window, float white);

/// Mean absolute difference of the quantiles of target and source, over R, G and B, 8-bit units.
double histogram_distance(const AlbedoMap& source, const AlbedoMap& target, float white);

/// The albedo that counts as white: the 99th percentile of the brightest channel; 1 for a black map.
float white_level(const AlbedoMap& albedo);

}  // namespace darkbox
