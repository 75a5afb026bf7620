#pragma once

#include <opencv2/core.hpp>

#include "processing/maps/maps.h"

namespace darkbox {

/// A surface as it is looked at when a transfer is judged: what its pixels show and which way they face. Valid where
/// the normals are.
struct Appearance {
    NormalMap normals;
    cv::Mat3b picture;  ///< R, G, B as displayed: sRGB-encoded
};

/// The albedo as displayed; `white` counts 255. Valid where both maps are.
Appearance appearance_of(const NormalMap& normals, const AlbedoMap& albedo, float white);

/// The albedo that counts as white: the 99th percentile of the brightest channel; 1 for a black map.
float white_level(const AlbedoMap& albedo);

/// The valid pixels whose neighbours up to `radius` away in both directions are valid too.
cv::Mat1b inner_pixels(const cv::Mat1b& valid, int radius);

}  // namespace darkbox
