#pragma once

#include <opencv2/core.hpp>

#include "processing/maps/maps.h"

namespace darkbox {

/// Height above the picture plane in pixels, z to the camera; its mean is 0 over each connected part; 0 where not
/// valid. Least squares over the mask: for every pair of valid neighbours the height difference is the mean slope of
/// the two, -n_x/n_z and n_y/n_z, so no boundary condition is assumed (Durou, Queau, Aujol 2018, "Normal integration",
/// J. Math. Imaging and Vision 60, quadratic formulation). Orthographic. Throws InputError for an empty map.
cv::Mat1f integrate_normals(const NormalMap& normals);

}  // namespace darkbox
