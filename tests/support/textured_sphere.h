#pragma once

#include <cmath>
#include <numbers>
#include <opencv2/core.hpp>

#include "processing/maps/maps.h"

namespace darkbox::test {

/// A Lambert sphere with a smooth texture, and everything about it known exactly.
struct TexturedSphere {
    PhotoStack stack;
    Lights lights;
    NormalMap normals;
    AlbedoMap albedo;
    IndexMap index;  ///< six texels of mixed albedo, in stripes
};

/// Lights on a ring 40 degrees off the view axis; their intensities differ.
inline Lights ring_of_lights(int count) {
    Lights lights;
    for (int i = 0; i < count; ++i) {
        const double turn = 2 * std::numbers::pi * i / count;
        const double tilt = 40 * std::numbers::pi / 180;
        Light light;
        light.file = "ring-" + std::to_string(i) + ".png";
        light.direction = {std::sin(tilt) * std::cos(turn), std::sin(tilt) * std::sin(turn), std::cos(tilt)};
        light.intensity = {0.8 + 0.05 * i, 1.0, 1.3 - 0.05 * i};
        lights.push_back(light);
    }
    return lights;
}

inline double n_dot_l(const cv::Vec3f& normal, const Light& light) {
    return normal[0] * light.direction[0] + normal[1] * light.direction[1] + normal[2] * light.direction[2];
}

/// What a camera sees of the object under one light, without shadows cast.
inline cv::Mat3f lambert_photograph(const NormalMap& normals, const AlbedoMap& albedo, const Light& light) {
    cv::Mat3f image(albedo.albedo.size(), cv::Vec3f(0, 0, 0));
    for (int y = 0; y < image.rows; ++y)
        for (int x = 0; x < image.cols; ++x) {
            const double r = std::max(0.0, n_dot_l(normals.normal(y, x), light));
            for (int c = 0; c < 3; ++c)
                image(y, x)[c] = static_cast<float>(albedo.albedo(y, x)[c] * r * light.intensity[c]);
        }
    return image;
}

inline TexturedSphere textured_sphere(int side, int light_count = 12) {
    TexturedSphere scene;
    const cv::Size size(side, side);
    scene.normals = {cv::Mat3f(size, cv::Vec3f(0, 0, 0)), cv::Mat1b(size, std::uint8_t{0})};
    scene.albedo = {cv::Mat3f(size, cv::Vec3f(0, 0, 0)), cv::Mat1b(size, std::uint8_t{0})};
    scene.index = {cv::Mat1w(size, std::uint16_t{0}), 6};
    const double centre = 0.5 * (side - 1);
    const double radius = 0.47 * side;
    for (int y = 0; y < side; ++y)
        for (int x = 0; x < side; ++x) {
            const double nx = (x - centre) / radius;
            const double ny = (centre - y) / radius;
            if (nx * nx + ny * ny >= 1) continue;
            const double nz = std::sqrt(1 - nx * nx - ny * ny);
            scene.normals.normal(y, x) = cv::Vec3d(nx, ny, nz);
            scene.albedo.albedo(y, x) =
                cv::Vec3d(0.4 + 0.2 * std::sin(9 * nx), 0.35 + 0.2 * std::cos(7 * ny), 0.3 + 0.1 * std::sin(8 * nz));
            scene.index.label(y, x) = static_cast<std::uint16_t>(1 + (x / 5) % 6);
            scene.normals.valid(y, x) = scene.albedo.valid(y, x) = 255;
        }
    scene.lights = ring_of_lights(light_count);
    scene.stack.mask = scene.albedo.valid.clone();
    for (const Light& light : scene.lights) {
        scene.stack.images.push_back(lambert_photograph(scene.normals, scene.albedo, light));
        scene.stack.clipped.emplace_back(size, std::uint8_t{0});
        scene.stack.files.push_back(light.file);
    }
    return scene;
}

}  // namespace darkbox::test
