#pragma once

#include "processing/relight/relight.h"
#include "processing/shading/shading.h"
#include "tests/support/textured_sphere.h"

namespace darkbox::test {

/// The textured sphere, ready to be relit: its shading maps come from its photographs.
inline RelightScene sphere_scene(int side) {
    const TexturedSphere s = textured_sphere(side);
    return {s.normals, s.albedo, s.index, shading_maps(s.stack, s.lights, s.normals, s.albedo, s.index).maps};
}

inline Light light_from(double x, double y, double z) {
    Light light;
    light.direction = Eigen::Vector3d(x, y, z).normalized();
    return light;
}

inline double largest_difference(cv::InputArray a, cv::InputArray b) { return cv::norm(a, b, cv::NORM_INF); }

/// RMS difference over the RMS of the truth.
inline double relative_rms(const cv::Mat3f& image, const cv::Mat3f& truth) {
    return cv::norm(image, truth, cv::NORM_L2) / cv::norm(truth, cv::NORM_L2);
}

}  // namespace darkbox::test
