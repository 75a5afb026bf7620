#pragma once

#include <opencv2/core.hpp>

#include "processing/maps/lights.h"
#include "processing/maps/view.h"
#include "processing/relight/pixel_block.h"

namespace darkbox {

// A near lamp's light as it arrives at a block of pixels. Viewer frame, millimetres.

struct NearLamp {
    explicit NearLamp(const LampPosition& lamp);

    cv::Vec3f position;
    float squared_reference;  ///< of the distance at which the light's intensity holds
};

/// Points of the surface, as planes.
struct alignas(64) PointBlock {
    float x[block_pixels];
    float y[block_pixels];
    float z[block_pixels];
};

/// The points that the pixels from (row, first_column) on show; beyond the picture's right border in the plane z = 0.
/// The view is known.
void find_points(const SceneGeometry& geometry, int row, int first_column, PointBlock& points);

struct alignas(64) RayBlock {
    float direction[3][block_pixels];  ///< unit, to the lamp
    float falloff[block_pixels];       ///< irradiance there over the light's intensity
};

void find_rays(const NearLamp& lamp, const PointBlock& points, RayBlock& rays);

}  // namespace darkbox
