#pragma once

#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>

#include "processing/relight/relight.h"

namespace darkbox {

// The rendering coefficient r of a normal and a direction to the light, both unit vectors, seen from V = (0, 0, 1).
// Another reflectance model is another such function object and a line in with_model().

/// r = max(0, N.L).
struct LambertCoefficient {
    float operator()(const cv::Vec3f& normal, const cv::Vec3f& light) const {
        return std::max(0.0F, normal.dot(light));
    }
};

/// r = k_d N.L + k_s max(0, R.V)^n with R the mirrored light; 0 where the light is behind the surface (Phong 1975).
struct PhongCoefficient {
    float specular;
    float exponent;

    float operator()(const cv::Vec3f& normal, const cv::Vec3f& light) const {
        const float n_dot_l = normal.dot(light);
        if (!(n_dot_l > 0)) return 0;
        const float r_dot_v = 2 * n_dot_l * normal[2] - light[2];
        const float highlight = r_dot_v > 0 ? std::pow(r_dot_v, exponent) : 0.0F;
        return (1 - specular) * n_dot_l + specular * highlight;
    }
};

/// Calls `body` with the coefficient that the options ask for, so that the choice is made once and not in each pixel.
template <class Body>
decltype(auto) with_model(const RelightOptions& options, Body&& body) {
    if (options.model == ReflectanceModel::phong)
        return body(
            PhongCoefficient{static_cast<float>(options.phong_specular), static_cast<float>(options.phong_exponent)});
    return body(LambertCoefficient{});
}

}  // namespace darkbox
