#pragma once

#include <opencv2/core.hpp>
#include <vector>

#include "processing/maps/maps.h"

namespace darkbox {

// Filters that know of a mask: a pixel is the weighted mean of the valid pixels under the kernel, and the weights that
// fall on invalid ones are shared out among the others (normalised convolution, Knutsson and Westin 1993). The
// background never bleeds in. Invalid pixels are (0, 0, 0).

/// Normals and albedo over the same valid pixels, at one resolution. The target's albedo is what has been synthesised.
struct MapLevel {
    cv::Mat3f normal;
    cv::Mat3f albedo;
    cv::Mat1b valid;

    bool has(cv::Point p) const {
        return p.x >= 0 && p.y >= 0 && p.x < valid.cols && p.y < valid.rows && valid(p) != 0;
    }
};

/// Finest first.
using MapPyramid = std::vector<MapLevel>;

/// Gaussian low-pass of unit normals, made unit again. `sigma` in pixels, 0 = none.
NormalMap low_pass(const NormalMap& normals, double sigma);

/// Where the coarser pixel (x, y) stands for the finer (2x, 2y) to (2x + 1, 2y + 1). It is valid where any of the four
/// is, so every valid pixel has a valid parent. Binomial 4 x 4 kernel over their common centre; normals made unit
/// again.
MapPyramid map_pyramid(MapLevel finest, int levels);

/// The option's number of levels, or for 0 as many as keep the shorter side at 32 pixels or more.
int pyramid_levels(int asked, cv::Size source, cv::Size target);

}  // namespace darkbox
