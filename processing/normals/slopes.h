#pragma once

#include <vector>

#include "processing/normals/integrate.h"
#include "processing/normals/pixel_grid.h"

namespace darkbox {

/// What a normal map says of the height differences around each pixel, in pixels. Confidence 0: not valid.
struct Slopes {
    PixelGrid grid;
    std::vector<float> right, down;
    std::vector<float> confidence;

    bool valid(std::size_t i) const { return confidence[i] > 0; }
    /// Squared cosine of the angle to the camera's ray: steep pixels say little of their height.
    float facing(std::size_t i) const { return 1.0F / (1.0F + right[i] * right[i] + down[i] * down[i]); }
};

/// Of the normals inside `box`.
Slopes slopes_of(const IntegrationInput& input, const cv::Rect& box);

/// At half the size: every pixel stands for the valid ones of a 2x2 block.
Slopes halved(const Slopes& fine);

}  // namespace darkbox
