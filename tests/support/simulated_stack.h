#pragma once

#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "processing/maps/maps.h"
#include "rig/description/rig_description.h"
#include "sim/renderer.h"
#include "sim/scenes.h"
#include "sim/sensor.h"

namespace darkbox::test {

/// What the simulated rig of `lamps` lamps sees of a scene, as photographs with their true lights and normals.
struct SimulatedStack {
    PhotoStack stack;
    Lights lights;
    cv::Mat3f normals;  ///< the mean over what a pixel shows: its centre alone is another normal where relief is fine
};

/// The mean of the object's normals along a pixel's camera rays, which are the centres of a finer picture's pixels.
inline cv::Mat3f mean_normals(sim::Scene scene) {
    constexpr int fine = sim::rays_per_pixel_side;
    cv::Mat3f means(scene.view.height, scene.view.width, cv::Vec3f::all(0));
    scene.view.width *= fine;
    scene.view.height *= fine;
    scene.view.mm_per_pixel /= fine;
    const sim::SceneTruth truth = sim::render_truth(scene);
    for (int y = 0; y < means.rows * fine; ++y)
        for (int x = 0; x < means.cols * fine; ++x) {
            const float* n = truth.normals.pixel(x, y);
            means(y / fine, x / fine) += cv::Vec3f(n[0], n[1], n[2]);
        }
    for (cv::Vec3f& n : means)
        if (const double length = cv::norm(n); length > 0) n *= static_cast<float>(1.0 / length);
    return means;
}

inline cv::Mat3f linear(const sim::Sensor& sensor, const std::vector<std::uint16_t>& samples, cv::Size size) {
    cv::Mat3f image(size);
    const double scale = 1.0 / (sensor.full_scale() - sensor.black_level);
    for (std::size_t i = 0; i < samples.size(); ++i)
        image(static_cast<int>(i / 3) / size.width, static_cast<int>(i / 3) % size.width)[static_cast<int>(i % 3)] =
            static_cast<float>((samples[i] - sensor.black_level) * scale);
    return image;
}

/// Distant lamps; the camera's noise, clipping and 12 bits. The mask leaves out the object's rim, where a pixel shows
/// the backdrop as well.
inline SimulatedStack simulated_stack(const std::string& scene_name, int lamps, int width) {
    RigDescription rig = parse_rig(simulated_rig_toml(lamps), "simulated rig");
    rig.sim.scene = scene_name;
    rig.sim.width = width;
    rig.sim.height = width * 3 / 4;
    const sim::Scene scene = sim::scene_by_name(rig.sim, rig.lamps, *rig.ball_diameter_mm);
    const sim::Renderer renderer(scene);
    std::vector<LampId> ids;
    for (int i = 0; i < lamps; ++i) ids.push_back({static_cast<std::uint32_t>(i)});
    const auto pictures = renderer.render(ids);
    const sim::SceneTruth truth = renderer.truth();
    const cv::Size size(rig.sim.width, rig.sim.height);

    SimulatedStack shot;
    const sim::Sensor sensor;
    for (std::size_t i = 0; i < pictures.size(); ++i) {
        const auto samples = sim::expose(sensor, pictures[i], {sensor.reference_exposure_s, 1.0, i});
        shot.stack.images.push_back(linear(sensor, samples, size));
        cv::Mat1b clipped(size, uchar{0});
        for (std::size_t k = 0; k < samples.size(); ++k)
            if (samples[k] >= sensor.full_scale()) clipped.data[k / 3] = 255;
        shot.stack.clipped.push_back(clipped);
        Light light;
        light.file = scene.lamps[i].name;
        const sim::Vec3 d = sim::direction_at_origin(scene.lamps[i]);
        light.direction = {d.x, d.y, d.z};
        shot.stack.files.push_back(light.file);
        shot.lights.push_back(light);
    }
    cv::Mat1b mask(size, uchar{0});
    shot.normals = mean_normals(scene);
    for (int y = 1; y + 1 < size.height; ++y)
        for (int x = 1; x + 1 < size.width; ++x) {
            bool inside = true;
            for (int dy = -1; dy <= 1; ++dy)
                for (int dx = -1; dx <= 1; ++dx)
                    inside = inside && truth.mask[static_cast<std::size_t>((y + dy) * size.width + x + dx)] != 0;
            mask(y, x) = inside ? 255 : 0;
        }
    shot.stack.mask = mask;
    return shot;
}

}  // namespace darkbox::test
