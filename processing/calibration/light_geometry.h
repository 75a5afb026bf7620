#pragma once

#include <optional>
#include <string>

#include "processing/maps/lights.h"

namespace darkbox {

/// How well a set of lights determines normals. Errors are standard deviations of the normal's angle in degrees, means
/// over the normals of the visible hemisphere that their lights determine. A normal is lit by the lights above its
/// horizon (attached shadows); what the object's other parts shade is not known here.
struct LightGeometry {
    double condition_number = 0;                ///< of all used lights together; infinite when they lie in one plane
    std::optional<double> noise_error_deg;      ///< per 1 % of noise; none where no normal is determined
    std::optional<double> direction_error_deg;  ///< from the lights' covariances; none where one is not known
    double undetermined_share = 0;  ///< of the visible hemisphere: normals with too few lights, or these in one plane
};

/// The used lights, each at the same noise: 1 % of the radiance of a surface that faces it. Directions' errors are
/// taken as independent of each other. Model: normal_error.h.
LightGeometry light_geometry(const Lights& lights);

/// "1 % of noise in the photographs turns normals by 0.4 degrees on average ...": the report's sentence.
std::string in_words(const LightGeometry& geometry);

}  // namespace darkbox
