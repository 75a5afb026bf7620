#pragma once

#include <cstdint>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "processing/maps/lights.h"

namespace darkbox {

// Conventions of every map here: rows x cols, pixel centres at integers, channels in R, G, B order (BGR exists only
// inside codecs), masks are 0 or 255. Radiance is linear, 1.0 = sensor full scale after black level.

/// The photographs of one object under one lamp each: linear, lamps-off frame already subtracted.
struct PhotoStack {
    std::vector<cv::Mat3f> images;   ///< all of one size
    std::vector<cv::Mat1b> clipped;  ///< 255 where any channel was at the sensor's limit; one per image
    std::vector<std::string> files;  ///< basename of each frame
    cv::Mat1b mask;                  ///< 255 on the object; same size as the images

    cv::Size size() const { return mask.size(); }
};

/// Unit normals in the viewer frame (x right, y up, z to the camera); (0, 0, 0) where not valid.
struct NormalMap {
    cv::Mat3f normal;
    cv::Mat1b valid;
};

/// Unshaded RGB on an absolute scale: radiance of a surface facing a light of intensity 1. Never normalised by its own
/// maximum.
struct AlbedoMap {
    cv::Mat3f albedo;
    cv::Mat1b valid;
};

/// A texel label for each pixel: 0 = outside, 1...texels inside.
struct IndexMap {
    cv::Mat1w label;
    int texels = 0;
};

/// Radiance of each texel against the rendering coefficient r at r_i = i / (levels - 1), for a light of intensity 1.
/// Thesis: S(k, r).
struct ShadingMaps {
    int texels = 0;
    int levels = 0;
    cv::Mat3f radiance;     ///< texels x levels; row k - 1 belongs to label k
    cv::Mat1i samples;      ///< texels x levels: photographs' samples behind each entry
    cv::Mat3f mean_albedo;  ///< texels x 1
};

/// Throws InputError when images, clipped, files and mask do not agree in number or size, or there are none.
void require_consistent(const PhotoStack& stack);

/// The three channels summed with equal weight over three: the luminance used for normals.
cv::Mat1f mean_channel(const cv::Mat3f& image);

}  // namespace darkbox
