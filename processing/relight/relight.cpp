#include "processing/relight/relight.h"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdint>

#include "acquisition/frame/error.h"
#include "processing/maps/parallel.h"
#include "processing/maps/require.h"
#include "processing/relight/coefficient.h"
#include "processing/relight/environment.h"
#include "processing/relight/levels.h"

namespace darkbox {
namespace {

constexpr float smallest_mean_albedo = 1e-6F;  ///< a ratio to less than this means nothing

class Stopwatch {
public:
    double seconds() const { return std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count(); }

private:
    std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

bool is_finite(const cv::Vec3f& value) {
    return std::isfinite(value[0]) && std::isfinite(value[1]) && std::isfinite(value[2]);
}

void require_range(const char* field, double value, double lowest, double highest) {
    if (!(value >= lowest && value <= highest))
        throw InputError(fmt::format("relight: {} is {}, allowed are {}...{}", field, value, lowest, highest),
                         fmt::format("set {} within that range", field));
}

void require_shading(const ShadingMaps& maps, int texels) {
    if (maps.texels != texels || maps.levels < 2 || maps.radiance.size() != cv::Size(maps.levels, maps.texels) ||
        maps.mean_albedo.size() != cv::Size(1, maps.texels))
        throw InputError(
            fmt::format("the shading maps are for {} texels and {} levels, but the index map has {} texels",
                        maps.texels, maps.levels, texels),
            "compute the shading maps again from these texels");
    if (!std::all_of(maps.radiance.begin(), maps.radiance.end(), is_finite) ||
        !std::all_of(maps.mean_albedo.begin(), maps.mean_albedo.end(), is_finite))
        throw InputError("the shading maps hold a value that is not a finite number", "compute them again");
}

void require_usable_normals(const NormalMap& normals) {
    for (int y = 0; y < normals.normal.rows; ++y)
        for (int x = 0; x < normals.normal.cols; ++x) {
            if (normals.valid(y, x) == 0) continue;
            const cv::Vec3f& n = normals.normal(y, x);
            if (!(std::abs(n.dot(n) - 1) < 0.01F))
                throw InputError(
                    fmt::format("the normal at pixel {}, {} is {}, {}, {}: not a unit vector", x, y, n[0], n[1], n[2]),
                    "normalise the normal map, or mark such pixels as not valid");
        }
}

void require_scene(const RelightScene& scene) {
    const cv::Size size = scene.index.label.size();
    if (size.empty()) throw InputError("the index map is empty", "compute the texels first");
    require_size("the normal map", scene.normals.normal.size(), size);
    require_size("the normal map's mask", scene.normals.valid.size(), size);
    require_size("the albedo map", scene.albedo.albedo.size(), size);
    require_size("the albedo map's mask", scene.albedo.valid.size(), size);
    require_labels(scene.index);
    require_shading(scene.shading, scene.index.texels);
    require_usable_normals(scene.normals);
}

void require_probe(const Environment& environment) {
    if (environment.radiance.empty()) throw InputError("the environment map is empty", "give a light probe");
    for (const cv::Vec3f& value : environment.radiance)
        if (!is_finite(value) || value[0] < 0 || value[1] < 0 || value[2] < 0)
            throw InputError(
                fmt::format("the environment map holds a radiance of {}, {}, {}", value[0], value[1], value[2]),
                "give a probe whose values are finite and not negative");
}

/// Exposure, and for Lookup::detail the pixel's own albedo over its texel's mean.
class PixelScale {
public:
    PixelScale(const RelightScene& scene, const RelightOptions& options)
        : exposure_(static_cast<float>(options.exposure)), per_albedo_(scene.index.texels, cv::Vec3f(0, 0, 0)) {
        if (options.lookup == Lookup::thesis) return;
        for (int k = 0; k < scene.index.texels; ++k)
            for (int c = 0; c < 3; ++c)
                if (const float mean = scene.shading.mean_albedo(k, 0)[c]; mean > smallest_mean_albedo)
                    per_albedo_[k][c] = exposure_ / mean;
    }

    /// A texel without albedo in a channel keeps its radiance; an albedo that is negative or not a number is black.
    float operator()(int label, const cv::Vec3f& albedo, int channel) const {
        const float scale = per_albedo_[label - 1][channel];
        return scale > 0 ? std::max(0.0F, scale * albedo[channel]) : exposure_;
    }

    float without_albedo() const { return exposure_; }

private:
    float exposure_;
    std::vector<cv::Vec3f> per_albedo_;  ///< of each texel; 0 = its radiance is not scaled by albedo
};

/// Every pixel of the object through `radiance(normal, label)`, which says how its texel is lit.
template <class Radiance>
cv::Mat3f render(const RelightScene& scene, const RelightOptions& options, const Radiance& radiance) {
    cv::Mat3f image(scene.index.label.size());
    const PixelScale scale(scene, options);
    tbb::parallel_for(0, image.rows, [&](int y) {
        const std::uint16_t* label = scene.index.label[y];
        const std::uint8_t* has_normal = scene.normals.valid[y];
        const std::uint8_t* has_albedo = scene.albedo.valid[y];
        const cv::Vec3f* normal = scene.normals.normal[y];
        const cv::Vec3f* albedo = scene.albedo.albedo[y];
        cv::Vec3f* out = image[y];
        for (int x = 0; x < image.cols; ++x) {
            if (label[x] == 0 || has_normal[x] == 0) {
                out[x] = cv::Vec3f(0, 0, 0);
                continue;
            }
            const cv::Vec3f lit = radiance(normal[x], label[x]);
            for (int c = 0; c < 3; ++c)
                out[x][c] = lit[c] * (has_albedo[x] != 0 ? scale(label[x], albedo[x], c) : scale.without_albedo());
        }
    });
    return image;
}

std::vector<DistantLight> used_lights(const Lights& lights) {
    std::vector<DistantLight> used;
    for (const Light& light : lights)
        if (light.used)
            used.push_back({cv::Vec3d(light.direction[0], light.direction[1], light.direction[2]),
                            cv::Vec3d(light.intensity[0], light.intensity[1], light.intensity[2])});
    return used;
}

}  // namespace

void RelightOptions::validate() const {
    require_range("phong_specular", phong_specular, 0, 1);
    require_range("phong_exponent", phong_exponent, 1, 1000);
    require_range("environment_yaw", environment_yaw, -1000, 1000);
    require_range("exposure", exposure, 0, 1e6);
}

RelightResult relight(const RelightScene& scene, const Lights& lights, const RelightOptions& options,
                      const WorkContext& work) {
    options.validate();
    require_scene(scene);
    require_lights(lights);
    const std::vector<DistantLight> used = used_lights(lights);
    RelightResult result;
    const Stopwatch rendering;
    on_threads_of(work, [&] {
        with_model(options, [&](const auto& coefficient) {
            result.image = render(scene, options, [&](const cv::Vec3f& normal, int label) {
                cv::Vec3f sum(0, 0, 0);
                for (const DistantLight& light : used)
                    add_shading(sum, light.intensity, scene.shading, label, coefficient(normal, light.direction));
                return sum;
            });
        });
    });
    result.render_seconds = rendering.seconds();
    return result;
}

RelightResult relight(const RelightScene& scene, const Environment& environment, const RelightOptions& options,
                      const WorkContext& work) {
    options.validate();
    require_scene(scene);
    require_probe(environment);
    RelightResult result;
    on_threads_of(work, [&] {
        const Stopwatch folding;
        const FoldedEnvironment folded(probe_lights(environment, options.environment_yaw), scene.shading, options);
        result.fold_seconds = folding.seconds();
        const Stopwatch rendering;
        result.image =
            render(scene, options, [&](const cv::Vec3f& normal, int label) { return folded.radiance(normal, label); });
        result.render_seconds = rendering.seconds();
    });
    return result;
}

cv::Mat3f at_constant_coefficient(const RelightScene& scene, double r, const RelightOptions& options,
                                  const WorkContext& work) {
    options.validate();
    require_scene(scene);
    require_range("the coefficient r", r, 0, 1);
    return on_threads_of(work, [&] {
        return render(scene, options, [&](const cv::Vec3f&, int label) {
            cv::Vec3f shading(0, 0, 0);
            add_shading(shading, {1, 1, 1}, scene.shading, label, static_cast<float>(r));
            return shading;
        });
    });
}

}  // namespace darkbox
