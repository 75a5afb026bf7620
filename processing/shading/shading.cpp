#include "processing/shading/shading.h"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <algorithm>
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

/// Everything a texel's samples are read from.
struct Views {
    const PhotoStack& stack;
    const Lights& lights;
    const NormalMap& normals;
    const AlbedoMap& albedo;
};

bool is_finite(const cv::Vec3d& value) {
    return std::isfinite(value[0]) && std::isfinite(value[1]) && std::isfinite(value[2]);
}

cv::Vec3d to_opencv(const Eigen::Vector3d& v) { return {v[0], v[1], v[2]}; }

cv::Vec3d per_intensity(const cv::Vec3f& radiance, const Eigen::Vector3d& intensity) {
    return {radiance[0] / intensity[0], radiance[1] / intensity[1], radiance[2] / intensity[2]};
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

void add_samples(const Views& views, cv::Point pixel, GainEstimator& estimator) {
    if (views.normals.valid(pixel) == 0) return;
    const cv::Vec3d normal = views.normals.normal(pixel);
    const cv::Vec3d albedo = views.albedo.albedo(pixel);
    for (std::size_t i = 0; i < views.lights.size(); ++i) {
        const Light& light = views.lights[i];
        if (!light.used || views.stack.clipped[i](pixel) != 0) continue;
        const double r = normal.dot(to_opencv(light.direction));
        if (!(r > 0)) continue;
        const cv::Vec3d radiance = per_intensity(views.stack.images[i](pixel), light.intensity);
        if (is_finite(radiance)) estimator.add(r, albedo, radiance);
    }
}

void measure_texel(const Views& views, const Pixels& pixels, int row, ShadingMaps& maps) {
    GainEstimator estimator(maps.levels);
    for (const cv::Point& pixel : pixels) add_samples(views, pixel, estimator);
    const GainCurve curve = estimator.curve();
    const cv::Vec3d mean = mean_albedo(views.albedo, pixels);
    maps.mean_albedo(row, 0) = mean;
    for (int level = 0; level < maps.levels; ++level) {
        const double r = static_cast<double>(level) / (maps.levels - 1);
        for (int c = 0; c < 3; ++c)
            maps.radiance(row, level)[c] = static_cast<float>(std::max(0.0, mean[c]) * r * curve.gain[level][c]);
        maps.samples(row, level) = curve.samples[level];
    }
}

/// The photographs are divided by them.
void require_intensities(const Lights& lights) {
    for (const Light& light : lights)
        if (light.used && !(light.intensity.minCoeff() > 0))
            throw InputError(fmt::format("the light of {} has an intensity of zero", light.file),
                             "correct the intensity, or mark the light as not used");
}

void require_inputs(const PhotoStack& stack, const Lights& lights, const NormalMap& normals, const AlbedoMap& albedo,
                    const IndexMap& index) {
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
    require_inputs(stack, lights, normals, albedo, index);

    ShadingResult result;
    ShadingMaps& maps = result.maps;
    maps.texels = index.texels;
    maps.levels = options.levels;
    maps.radiance = cv::Mat3f(maps.texels, maps.levels);
    maps.samples = cv::Mat1i(maps.texels, maps.levels);
    maps.mean_albedo = cv::Mat3f(maps.texels, 1);

    const Views views{stack, lights, normals, albedo};
    const std::vector<Pixels> texels = pixels_by_texel(index, albedo);
    work.tell({"shading", 0, texels.size(), {}});
    on_threads_of(work, [&] {
        tbb::parallel_for(0, maps.texels, [&](int row) {
            if (!work.cancelled()) measure_texel(views, texels[row], row, maps);
        });
    });
    if (work.cancelled()) throw Cancelled("the shading maps were stopped", "start it again when it suits");
    work.tell({"shading", texels.size(), texels.size(), {}});
    result.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    return result;
}

}  // namespace darkbox
