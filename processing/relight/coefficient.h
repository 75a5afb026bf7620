#pragma once

#include <algorithm>
#include <cmath>

#include "processing/relight/environment.h"

namespace darkbox {

/// What a light makes of a normal, both unit vectors, seen from V = (0, 0, 1).
struct Coefficients {
    double shading = 0;   ///< r, at which S is looked up
    double mirrored = 0;  ///< factor on the light's intensity that does not go through S
};

/// The models of ReflectanceModel, for folding (Phong 1975). Nothing is reflected by a surface that faces away.
inline Coefficients coefficients(const cv::Vec3d& normal, const cv::Vec3d& light, const RelightOptions& options) {
    const double n_dot_l = normal.dot(light);
    if (!(n_dot_l > 0)) return {};
    if (options.model == ReflectanceModel::lambert) return {n_dot_l, 0};
    const double r_dot_v = 2 * n_dot_l * normal[2] - light[2];
    const double highlight = r_dot_v > 0 ? options.phong_specular * std::pow(r_dot_v, options.phong_exponent) : 0.0;
    if (options.model == ReflectanceModel::phong) return {options.phong_diffuse * n_dot_l + highlight, 0};
    return {n_dot_l, highlight};
}

}  // namespace darkbox
