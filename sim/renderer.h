#pragma once

#include <cstddef>
#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "acquisition/frame/ids.h"
#include "sim/image.h"
#include "sim/ray_tracer.h"
#include "sim/scene.h"

namespace darkbox::sim {

/// Side of the regular grid of rays in every pixel.
constexpr int rays_per_pixel_side = 4;

/// What is true of the object at each pixel. Background: normal, albedo and height 0.
struct SceneTruth {
    RgbImage normals;                      ///< viewer frame, relief included, at the pixel's centre
    RgbImage albedo;                       ///< mean over the part of the pixel that the object covers
    std::vector<char> mask;                ///< 1 where the pixel's centre shows the object
    std::vector<float> heights;            ///< z of what the pixel's centre shows, viewer frame, mm
    std::vector<std::uint16_t> materials;  ///< of the texture where the pixel's centre shows it, from 1; 0 = outside
};

/// Takes one row of one of the pictures asked for, counted from 0: interleaved RGB. Called on any thread, once for
/// each.
using RowSink = std::function<void(std::size_t picture, int row, std::span<const float> rgb)>;

/// Traces rays from the camera: direct light with shadows, and one reflection on the mirror balls. Interreflection on
/// the object is left out, so that Lambert's and Phong's laws hold exactly. Refers to the scene. The same bits on any
/// number of threads; const members are thread-safe.
class Renderer {
public:
    explicit Renderer(const Scene& scene) : scene_(scene), tracer_(scene) {}

    /// One picture for each of these lamps, burning alone at full level: radiance, linear.
    std::vector<RgbImage> render(std::span<const LampId> lamps) const;
    /// The same row by row, for who does not keep them as they are.
    void render(std::span<const LampId> lamps, const RowSink& row_done) const;
    SceneTruth truth() const;

private:
    /// A visible point, ready to be lit.
    struct Fragment;
    /// What one ray from the camera sees: a point, and behind the ball's gloss what it mirrors.
    struct Sample;

    Sample sample(const Ray& ray) const;
    std::uint16_t texture_material(const Ray& ray) const;
    Fragment fragment(const Ray& ray, const std::optional<RayHit>& hit) const;
    Fragment box_fragment(const Ray& ray) const;
    Rgb radiance(const Sample& sample, const SceneLamp& lamp) const;
    Rgb radiance(const Fragment& fragment, const SceneLamp& lamp) const;
    Rgb glow(const Ray& mirrored_ray, const SceneLamp& lamp, double distance_to_solid_mm) const;

    const Scene& scene_;
    RayTracer tracer_;
};

/// The picture with one lamp burning, or none: black.
RgbImage render_radiance(const Scene& scene, std::optional<LampId> lamp);
SceneTruth render_truth(const Scene& scene);

}  // namespace darkbox::sim
