#include "sim/renderer.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>

#include "sim/noise.h"
#include "sim/reflectance.h"

namespace darkbox::sim {

struct Renderer::Fragment {
    Vec3 position;
    Vec3 geometric_normal;
    Vec3 smooth_normal;  ///< without the texture's relief
    Vec3 normal;
    Vec3 to_viewer;
    Rgb albedo;
    const Material* material = nullptr;  ///< none: matt
};

struct Renderer::Sample {
    struct Reflection {
        Ray ray;
        double distance_mm = 0.0;  ///< to the solid thing it meets; infinite when that is the box
        Fragment seen;
        double reflectance = 0.0;
    };
    Fragment seen;
    bool shows_object = false;
    std::optional<Reflection> reflection;
};

namespace {

/// Shadow rays start this far off the surface: more than a tessellated surface lies beneath the true one.
constexpr double shadow_offset_mm = 0.05;

/// The places of the rays within a pixel, relative to its centre.
constexpr std::array<double, rays_per_pixel_side> ray_offsets = [] {
    std::array<double, rays_per_pixel_side> offsets{};
    for (int i = 0; i < rays_per_pixel_side; ++i) offsets[i] = (i + 0.5) / rays_per_pixel_side - 0.5;
    return offsets;
}();

/// Calls f(u, v) for the rays of pixel (column, row), always in the same order.
template <class F>
void for_each_ray(int column, int row, const F& f) {
    for (const double dv : ray_offsets)
        for (const double du : ray_offsets) f(column + du, row + dv);
}

template <class F>
void for_each_row(int rows, const F& f) {
    tbb::parallel_for(tbb::blocked_range<int>(0, rows), [&](const tbb::blocked_range<int>& range) {
        for (int row = range.begin(); row < range.end(); ++row) f(row);
    });
}

/// Pi times the BRDF. Relief may turn a normal away from the camera; grazing light is all that is left then.
Rgb reflectance(const Material& material, const Rgb& albedo, const Vec3& n, const Vec3& l, const Vec3& v) {
    constexpr double grazing = 1e-3;
    double body = 1.0, gloss = 0.0;
    const bool seen = dot(n, v) > grazing;
    if (material.slope_sigma > 0.0 && seen) body *= oren_nayar(n, l, v, material.slope_sigma);
    if (material.coat_alpha > 0.0 && seen) {
        body *= coat_transmission(n, l, v);
        gloss += ggx(n, l, v, material.coat_alpha);
    }
    if (material.specular > 0.0) gloss += phong_lobe(n, l, v, material.specular, material.exponent);
    return albedo * body + Rgb{1, 1, 1} * gloss;
}

}  // namespace

Renderer::Fragment Renderer::box_fragment(const Ray& ray) const {
    const Box& box = scene_.box;
    struct Wall {
        Vec3 normal;  // into the box
        double offset;
        const Rgb* albedo;
    };
    const std::array<Wall, 6> walls{{{{0, 0, 1}, box.backdrop_z_mm, &box.backdrop},
                                     {{0, 0, -1}, -box.front_z_mm, &box.walls},
                                     {{1, 0, 0}, -box.half_width_mm, &box.walls},
                                     {{-1, 0, 0}, -box.half_width_mm, &box.walls},
                                     {{0, 1, 0}, -box.half_width_mm, &box.walls},
                                     {{0, -1, 0}, -box.half_width_mm, &box.walls}}};
    const Wall* nearest = nullptr;
    double distance = std::numeric_limits<double>::infinity();
    for (const Wall& wall : walls) {
        const double approach = -dot(ray.direction, wall.normal);
        if (approach <= 0.0) continue;
        const double t = (dot(ray.origin, wall.normal) - wall.offset) / approach;
        if (t < distance) {
            distance = t;
            nearest = &wall;
        }
    }
    return {ray.origin + ray.direction * distance,
            nearest->normal,
            nearest->normal,
            nearest->normal,
            -ray.direction,
            *nearest->albedo};
}

Renderer::Fragment Renderer::fragment(const Ray& ray, const std::optional<RayHit>& hit) const {
    if (!hit) return box_fragment(ray);
    Fragment seen{hit->point.position, hit->geometric_normal, hit->normal, hit->normal, -ray.direction, {}};
    if (hit->ball != nullptr) {
        seen.albedo = hit->ball->body;
        return seen;
    }
    const Material& material = *hit->material;
    seen.albedo = material.texture->albedo(hit->point);
    seen.normal = normal_with_relief(*material.texture, hit->point, hit->normal);
    seen.material = &material;
    return seen;
}

Renderer::Sample Renderer::sample(const Ray& ray) const {
    const auto hit = tracer_.first_hit(ray);
    Sample result{fragment(ray, hit), hit && hit->ball == nullptr, std::nullopt};
    if (hit && hit->ball != nullptr) {
        const Ray onward{hit->point.position + hit->normal * shadow_offset_mm, mirrored(ray.direction, hit->normal)};
        const auto next = tracer_.first_hit(onward);
        result.reflection = {onward, next ? next->distance_mm : std::numeric_limits<double>::infinity(),
                             fragment(onward, next), hit->ball->reflectance};
    }
    return result;
}

Rgb Renderer::radiance(const Fragment& f, const SceneLamp& lamp) const {
    const Incidence light = incidence(scene_, lamp, f.position);
    const double cosine = dot(f.normal, light.direction);
    // A relief turns normals only; what faces away from the lamp as a whole is in its own shadow.
    if (cosine <= 0.0 || dot(f.smooth_normal, light.direction) <= 0.0) return {};
    if (tracer_.blocked({f.position + f.geometric_normal * shadow_offset_mm, light.direction}, light.distance_mm))
        return {};
    const Rgb per_cosine =
        f.material ? reflectance(*f.material, f.albedo, f.normal, light.direction, f.to_viewer) : f.albedo;
    return per_cosine * light.irradiance * cosine;
}

/// A lamp of angular radius a that gives irradiance E has radiance E / (pi a^2); in units where a white matt surface
/// has radiance E that is E / a^2. Frosted glass has a soft rim, which also keeps the highlight's outline smooth.
Rgb Renderer::glow(const Ray& ray, const SceneLamp& lamp, double distance_to_solid_mm) const {
    const Incidence light = incidence(scene_, lamp, ray.origin);
    if (distance_to_solid_mm < light.distance_mm) return {};
    const double distance = std::min(light.distance_mm, length(lamp.position));
    const double angular_radius = lamp.radius_mm / distance;
    const double angle = 2.0 * std::asin(std::min(1.0, 0.5 * length(ray.direction - light.direction)));
    const double inside = 1.0 - smooth_step(0.75 * angular_radius, 1.25 * angular_radius, angle);
    return light.irradiance * (inside / (angular_radius * angular_radius));
}

Rgb Renderer::radiance(const Sample& s, const SceneLamp& lamp) const {
    Rgb sum = radiance(s.seen, lamp);
    if (s.reflection) {
        const auto& r = *s.reflection;
        sum += (radiance(r.seen, lamp) + glow(r.ray, lamp, r.distance_mm)) * r.reflectance;
    }
    return sum;
}

std::vector<RgbImage> Renderer::render(std::span<const LampId> lamps) const {
    std::vector<RgbImage> pictures(lamps.size(), RgbImage(scene_.view.width, scene_.view.height));
    render(lamps, [&](std::size_t picture, int row, std::span<const float> rgb) {
        std::copy(rgb.begin(), rgb.end(), pictures[picture].pixel(0, row));
    });
    return pictures;
}

void Renderer::render(std::span<const LampId> lamps, const RowSink& row_done) const {
    const View& view = scene_.view;
    constexpr double share = 1.0 / (rays_per_pixel_side * rays_per_pixel_side);
    for_each_row(view.height, [&](int row) {
        std::vector<Rgb> sums(lamps.size());
        std::vector<RgbImage> rows(lamps.size(), RgbImage(view.width, 1));
        for (int column = 0; column < view.width; ++column) {
            std::fill(sums.begin(), sums.end(), Rgb{});
            for_each_ray(column, row, [&](double u, double v) {
                const Sample seen = sample(camera_ray(view, u, v));
                for (std::size_t i = 0; i < lamps.size(); ++i)
                    sums[i] += radiance(seen, scene_.lamps.at(lamps[i].value));
            });
            for (std::size_t i = 0; i < lamps.size(); ++i) rows[i].set(column, 0, sums[i] * share);
        }
        for (std::size_t i = 0; i < lamps.size(); ++i) row_done(i, row, rows[i].samples);
    });
}

/// As in SceneTruth, of what a ray that meets the object shows.
std::uint16_t Renderer::texture_material(const Ray& ray) const {
    const auto hit = tracer_.first_hit(ray);
    return static_cast<std::uint16_t>(hit.value().material->texture->material(hit->point) + 1);
}

SceneTruth Renderer::truth() const {
    const View& view = scene_.view;
    SceneTruth truth{RgbImage(view.width, view.height), RgbImage(view.width, view.height),
                     std::vector<char>(static_cast<std::size_t>(view.width) * view.height, 0),
                     std::vector<float>(static_cast<std::size_t>(view.width) * view.height, 0.0F),
                     std::vector<std::uint16_t>(static_cast<std::size_t>(view.width) * view.height, 0)};
    for_each_row(view.height, [&](int row) {
        for (int column = 0; column < view.width; ++column) {
            const Sample centre = sample(camera_ray(view, column, row));
            if (!centre.shows_object) continue;
            const Vec3& n = centre.seen.normal;
            const std::size_t pixel = static_cast<std::size_t>(row) * view.width + column;
            truth.mask[pixel] = 1;
            truth.materials[pixel] = texture_material(camera_ray(view, column, row));
            truth.heights[pixel] = static_cast<float>(centre.seen.position.z);
            truth.normals.set(column, row, {n.x, n.y, n.z});
            Rgb sum;
            int count = 0;
            for_each_ray(column, row, [&](double u, double v) {
                const Sample seen = sample(camera_ray(view, u, v));
                if (!seen.shows_object) return;
                sum += seen.seen.albedo;
                ++count;
            });
            truth.albedo.set(column, row, count > 0 ? sum * (1.0 / count) : centre.seen.albedo);
        }
    });
    return truth;
}

RgbImage render_radiance(const Scene& scene, std::optional<LampId> lamp) {
    if (!lamp) return {scene.view.width, scene.view.height};
    return std::move(Renderer(scene).render(std::array{*lamp}).front());
}

SceneTruth render_truth(const Scene& scene) { return Renderer(scene).truth(); }

}  // namespace darkbox::sim
