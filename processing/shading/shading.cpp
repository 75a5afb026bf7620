#include "processing/shading/shading.h"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <vector>

#include "acquisition/frame/error.h"
#include "processing/maps/parallel.h"
#include "processing/maps/require.h"
#include "processing/shading/gain_curve.h"

namespace darkbox {
namespace {

using Pixels = std::vector<cv::Point>;

constexpr double smallest_evidence = 1e-4;  ///< sum of S(k, r)^2 for an albedo of 1 that tells a pixel's own albedo

/// Everything a texel's samples are read from.
struct Views {
    const PhotoStack& stack;
    const Lights& lights;
    const NormalMap& normals;
    const AlbedoMap& albedo;
    const SceneGeometry& geometry;
};

bool is_finite(const cv::Vec3d& value) {
    return std::isfinite(value[0]) && std::isfinite(value[1]) && std::isfinite(value[2]);
}

cv::Vec3d per_irradiance(const cv::Vec3f& radiance, const Eigen::Vector3d& irradiance) {
    return {radiance[0] / irradiance[0], radiance[1] / irradiance[1], radiance[2] / irradiance[2]};
}

std::vector<Pixels> pixels_by_texel(const IndexMap& index, const AlbedoMap& albedo) {
    std::vector<Pixels> texels(index.texels);
    for (int y = 0; y < index.label.rows; ++y)
        for (int x = 0; x < index.label.cols; ++x)
            if (const int label = index.label(y, x);
                label > 0 && albedo.valid(y, x) != 0 && is_finite(albedo.albedo(y, x)))
                texels[label - 1].emplace_back(x, y);
    return texels;
}

cv::Vec3d mean_albedo(const AlbedoMap& albedo, const Pixels& pixels) {
    cv::Vec3d sum(0, 0, 0);
    for (const cv::Point& pixel : pixels) sum += cv::Vec3d(albedo.albedo(pixel));
    return pixels.empty() ? sum : sum * (1.0 / static_cast<double>(pixels.size()));
}

/// Calls `sample(r, radiance for a light of intensity 1)` for each photograph that shows the pixel lit and not clipped.
template <class Sample>
void for_samples(const Views& views, cv::Point pixel, Sample&& sample) {
    const cv::Vec3f& n = views.normals.normal(pixel);
    if (views.normals.valid(pixel) == 0 || !is_finite(n)) return;
    const Eigen::Vector3d normal(n[0], n[1], n[2]);
    for (std::size_t i = 0; i < views.lights.size(); ++i) {
        const Light& light = views.lights[i];
        if (!light.used || views.stack.clipped[i](pixel) != 0) continue;
        const Incidence at =
            light.near ? incidence(light, views.geometry.point_at(pixel.y, pixel.x)) : Incidence{light.direction, 1};
        const double r = normal.dot(at.direction);
        if (!(r > 0)) continue;
        const cv::Vec3d radiance = per_irradiance(views.stack.images[i](pixel), light.intensity * at.falloff);
        if (is_finite(radiance)) sample(r, radiance);
    }
}

GainCurve measured_curve(const Views& views, const Pixels& pixels, int levels) {
    GainEstimator estimator(levels);
    for (const cv::Point& pixel : pixels)
        for_samples(views, pixel, [&, albedo = cv::Vec3d(views.albedo.albedo(pixel))](double r, const cv::Vec3d& seen) {
            estimator.add(r, albedo, seen);
        });
    return estimator.curve();
}

/// What a pixel's samples say of its albedo under its texel's curve: least squares, per channel.
struct Evidence {
    cv::Vec3d by_radiance{0, 0, 0}, squared{0, 0, 0};

    bool tells(int channel) const { return squared[channel] > smallest_evidence; }
    /// Drawn towards `mean` as by `weight` of evidence for it, and without one sample of those summed up.
    double albedo(int channel, double mean, double weight, double shading = 0, double radiance = 0) const {
        const double evidence = squared[channel] - shading * shading + weight;
        if (!(evidence > smallest_evidence)) return mean;
        return std::max(0.0, (by_radiance[channel] - shading * radiance + weight * mean) / evidence);
    }
};

Evidence evidence_of(const GainCurve& curve, const Views& views, cv::Point pixel) {
    Evidence evidence;
    for_samples(views, pixel, [&](double r, const cv::Vec3d& radiance) {
        const cv::Vec3d shading = curve.shading(r);
        evidence.by_radiance += shading.mul(radiance);
        evidence.squared += shading.mul(shading);
    });
    return evidence;
}

/// How far a texel's pixels are drawn towards its common albedo: as far as predicts best each sample from the others of
/// its pixel (cross-validation, Stone 1974; in closed form, since the albedo is linear in the samples). Without one
/// sample means without one photograph, as each photograph shows a pixel once.
class Drawing {
public:
    Drawing(const GainCurve& curve, const Views& views, const Pixels& pixels, const std::vector<Evidence>& evidence) {
        Evidence whole;
        for (const Evidence& pixel : evidence) {
            whole.by_radiance += pixel.by_radiance;
            whole.squared += pixel.squared;
        }
        for (int c = 0; c < 3; ++c) mean_[c] = whole.albedo(c, 0, 0);
        std::array<cv::Vec3d, weights.size()> missed{};
        for (std::size_t i = 0; i < pixels.size(); ++i)
            for_samples(views, pixels[i], [&](double r, const cv::Vec3d& radiance) {
                const cv::Vec3d shading = curve.shading(r);
                for (std::size_t w = 0; w < weights.size(); ++w)
                    for (int c = 0; c < 3; ++c) {
                        const double albedo = evidence[i].albedo(c, mean_[c], weights[w], shading[c], radiance[c]);
                        missed[w][c] += std::pow(radiance[c] - shading[c] * albedo, 2);
                    }
            });
        for (int c = 0; c < 3; ++c)
            for (std::size_t w = 1; w < weights.size(); ++w)
                if (missed[w][c] < missed[best_[c]][c]) best_[c] = w;
    }

    double albedo(const Evidence& pixel, int channel) const {
        return pixel.albedo(channel, mean_[channel], weights[best_[channel]]);
    }

private:
    /// Of the common albedo, as if it were that sum of S(k, r)^2 in samples: from nothing to nothing but that albedo.
    /// A photograph that the pixel faces squarely counts 1.
    static constexpr std::array<double, 14> weights{0, 0.01, 0.03, 0.1, 0.2, 0.4, 0.8, 1.6, 3, 6, 12, 50, 200, 1e9};

    cv::Vec3d mean_{0, 0, 0};
    std::array<std::size_t, 3> best_{};
};

void measure_albedo(const GainCurve& curve, const Views& views, const Pixels& pixels, AlbedoMap& albedo) {
    std::vector<Evidence> evidence;
    for (const cv::Point& pixel : pixels) evidence.push_back(evidence_of(curve, views, pixel));
    const Drawing drawing(curve, views, pixels, evidence);
    for (std::size_t i = 0; i < pixels.size(); ++i)
        for (int c = 0; c < 3; ++c)
            if (evidence[i].tells(c)) albedo.albedo(pixels[i])[c] = static_cast<float>(drawing.albedo(evidence[i], c));
}

void measure_texel(const Views& views, const Pixels& pixels, int row, ShadingResult& result) {
    ShadingMaps& maps = result.maps;
    const GainCurve curve = measured_curve(views, pixels, maps.levels);
    const cv::Vec3d mean = mean_albedo(views.albedo, pixels);
    maps.mean_albedo(row, 0) = mean;
    for (int level = 0; level < maps.levels; ++level) {
        const double r = static_cast<double>(level) / (maps.levels - 1);
        for (int c = 0; c < 3; ++c)
            maps.radiance(row, level)[c] = static_cast<float>(std::max(0.0, mean[c]) * r * curve.gain[level][c]);
        maps.samples(row, level) = curve.samples[level];
    }
    measure_albedo(curve, views, pixels, result.albedo);
}

/// The photographs are divided by them.
void require_intensities(const Lights& lights) {
    for (const Light& light : lights)
        if (light.used && !(light.intensity.minCoeff() > 0))
            throw InputError(fmt::format("the light of {} has an intensity of zero", light.file),
                             "correct the intensity, or mark the light as not used");
}

/// A near light's direction depends on where the pixel lies.
void require_geometry(const Lights& lights, const SceneGeometry& geometry, cv::Size size) {
    for (const Light& light : lights)
        if (light.used && light.near && !geometry.view)
            throw InputError(fmt::format("the light of {} is near, but where the pixels lie is not known", light.file),
                             "give the view: millimetres per pixel at the object");
    if (!geometry.height_mm.empty()) require_size("the height map", geometry.height_mm.size(), size);
}

void require_inputs(const PhotoStack& stack, const Lights& lights, const NormalMap& normals, const AlbedoMap& albedo,
                    const IndexMap& index, const SceneGeometry& geometry) {
    require_consistent(stack);
    if (lights.size() != stack.images.size())
        throw InputError(fmt::format("there are {} photographs but {} lights", stack.images.size(), lights.size()),
                         "give one light for each photograph, in the same order");
    require_lights(lights);
    require_intensities(lights);
    require_size("the normal map", normals.normal.size(), stack.size());
    require_size("the normal map's mask", normals.valid.size(), stack.size());
    require_size("the albedo map", albedo.albedo.size(), stack.size());
    require_size("the albedo map's mask", albedo.valid.size(), stack.size());
    require_size("the index map", index.label.size(), stack.size());
    require_labels(index);
    require_geometry(lights, geometry, stack.size());
    if (index.texels < 1) throw InputError("the index map has no texels", "compute the texels first");
}

}  // namespace

void ShadingOptions::validate() const {
    if (levels < 2 || levels > 256)
        throw InputError(fmt::format("shading: levels is {}, allowed are 2...256", levels),
                         "set levels within that range");
}

ShadingResult shading_maps(const PhotoStack& stack, const Lights& lights, const NormalMap& normals,
                           const AlbedoMap& albedo, const IndexMap& index, const ShadingOptions& options,
                           const WorkContext& work) {
    const auto start = std::chrono::steady_clock::now();
    options.validate();
    require_inputs(stack, lights, normals, albedo, index, options.geometry);

    ShadingResult result;
    ShadingMaps& maps = result.maps;
    maps.texels = index.texels;
    maps.levels = options.levels;
    maps.radiance = cv::Mat3f(maps.texels, maps.levels);
    maps.samples = cv::Mat1i(maps.texels, maps.levels);
    maps.mean_albedo = cv::Mat3f(maps.texels, 1);

    result.albedo = {albedo.albedo.clone(), albedo.valid.clone()};

    const Views views{stack, lights, normals, albedo, options.geometry};
    const std::vector<Pixels> texels = pixels_by_texel(index, albedo);
    work.tell({"shading", 0, texels.size(), {}});
    on_threads_of(work, [&] {
        tbb::parallel_for(0, maps.texels, [&](int row) {
            if (!work.cancelled()) measure_texel(views, texels[row], row, result);
        });
    });
    if (work.cancelled()) throw Cancelled("the shading maps were stopped", "start it again when it suits");
    work.tell({"shading", texels.size(), texels.size(), {}});
    result.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    return result;
}

}  // namespace darkbox
