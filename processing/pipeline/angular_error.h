#pragma once

#include <cstddef>
#include <opencv2/core.hpp>
#include <optional>
#include <vector>

#include "processing/maps/maps.h"

namespace darkbox {

/// Angles between what was computed and what is true.
struct AngularError {
    double mean_deg = 0;
    double median_deg = 0;
    double p95_deg = 0;
    double max_deg = 0;
    std::size_t count = 0;
};

/// No value for no angles; an angle that is not a number is an error of the caller. Order does not matter.
std::optional<AngularError> summarise_angles(std::vector<double> angles_deg);

/// The angle between two normals at each pixel, degrees; NaN where either map is not valid. Throws InputError when
/// the sizes differ.
cv::Mat1d angles_between_deg(const NormalMap& computed, const NormalMap& truth);

/// Over pixels valid in both maps. Throws InputError when the sizes differ or no pixel is valid in both.
AngularError angular_error(const NormalMap& computed, const NormalMap& truth);

}  // namespace darkbox
