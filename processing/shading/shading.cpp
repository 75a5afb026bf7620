#include "processing/shading/shading.h"

#include <fmt/format.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_invoke.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <utility>
#include <vector>

#include "acquisition/frame/error.h"
#include "processing/maps/parallel.h"
#include "processing/maps/photo_pixel.h"
#include "processing/maps/require.h"
#include "processing/normals/bands.h"
#include "processing/shading/gain_curve.h"
#include "processing/shading/shading_bands.h"

namespace darkbox {
namespace {

using Pixels = std::vector<cv::Point>;

constexpr double smallest_evidence = 1e-4;  ///< sum of S(k, r)^2 for an albedo of 1 that tells a pixel's own albedo

/// Everything a texel's samples are read from.
struct Views {
    const PhotoBand& band;
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
        const PhotoRows& photo = views.band.photos[i];
        if (!light.used || clipped_at(photo, pixel.y - views.band.first_row, pixel.x)) continue;
        const Incidence at =
            light.near ? incidence(light, views.geometry.point_at(pixel.y, pixel.x)) : Incidence{light.direction, 1};
        const double r = normal.dot(at.direction);
        if (!(r > 0)) continue;
        const cv::Vec3d radiance =
            per_irradiance(radiance_at(photo, pixel.y - views.band.first_row, pixel.x), light.intensity * at.falloff);
        if (is_finite(radiance)) sample(r, radiance);
    }
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
    /// `evidence`: of all the texel's pixels.
    void set_mean(const std::vector<Evidence>& evidence) {
        Evidence whole;
        for (const Evidence& pixel : evidence) {
            whole.by_radiance += pixel.by_radiance;
            whole.squared += pixel.squared;
        }
        for (int c = 0; c < 3; ++c) mean_[c] = whole.albedo(c, 0, 0);
    }

    /// Tries every weight on one pixel's samples.
    void try_on(const GainCurve& curve, const Views& views, cv::Point pixel, const Evidence& evidence) {
        for_samples(views, pixel, [&](double r, const cv::Vec3d& radiance) {
            const cv::Vec3d shading = curve.shading(r);
            for (std::size_t w = 0; w < weights.size(); ++w)
                for (int c = 0; c < 3; ++c) {
                    const double albedo = evidence.albedo(c, mean_[c], weights[w], shading[c], radiance[c]);
                    missed_[w][c] += std::pow(radiance[c] - shading[c] * albedo, 2);
                }
        });
    }

    void choose() {
        for (int c = 0; c < 3; ++c)
            for (std::size_t w = 1; w < weights.size(); ++w)
                if (missed_[w][c] < missed_[best_[c]][c]) best_[c] = w;
    }

    double albedo(const Evidence& pixel, int channel) const {
        return pixel.albedo(channel, mean_[channel], weights[best_[channel]]);
    }

private:
    /// Of the common albedo, as if it were that sum of S(k, r)^2 in samples: from nothing to nothing but that albedo.
    /// A photograph that the pixel faces squarely counts 1.
    static constexpr std::array<double, 14> weights{0, 0.01, 0.03, 0.1, 0.2, 0.4, 0.8, 1.6, 3, 6, 12, 50, 200, 1e9};

    cv::Vec3d mean_{0, 0, 0};
    std::array<cv::Vec3d, weights.size()> missed_{};
    std::array<std::size_t, 3> best_{};
};

/// What is known of a texel while bands pass: its pixels come in rows from the top, and all sums grow in their order.
struct Texel {
    Texel(Pixels own, int levels) : pixels(std::move(own)), estimator(levels) {}

    Pixels pixels;
    GainEstimator estimator;
    GainCurve curve;
    std::vector<Evidence> evidence;  ///< of the pixels seen so far
    Drawing drawing;

    static std::size_t bytes(int levels) {
        return sizeof(Texel) + GainEstimator::bytes(levels) +
               static_cast<std::size_t>(levels) * (sizeof(cv::Vec3d) + sizeof(int));
    }
    static constexpr std::size_t bytes_per_pixel = sizeof(cv::Point) + sizeof(Evidence);
};

/// Those of the texel's pixels that lie in the band: from one place in their list to another.
std::pair<std::size_t, std::size_t> pixels_in(const PhotoBand& band, const Pixels& pixels) {
    const auto above = [](const cv::Point& pixel, int row) { return pixel.y < row; };
    const auto begin = std::lower_bound(pixels.begin(), pixels.end(), band.first_row, above);
    const auto end = std::lower_bound(begin, pixels.end(), band.first_row + band.rows(), above);
    return {static_cast<std::size_t>(begin - pixels.begin()), static_cast<std::size_t>(end - pixels.begin())};
}

void add_samples(const Views& views, Texel& texel) {
    const auto [begin, end] = pixels_in(views.band, texel.pixels);
    for (std::size_t i = begin; i < end; ++i) {
        const cv::Vec3d albedo(views.albedo.albedo(texel.pixels[i]));
        for_samples(views, texel.pixels[i],
                    [&](double r, const cv::Vec3d& seen) { texel.estimator.add(r, albedo, seen); });
    }
}

void add_evidence(const Views& views, Texel& texel) {
    const auto [begin, end] = pixels_in(views.band, texel.pixels);
    for (std::size_t i = begin; i < end; ++i)
        texel.evidence.push_back(evidence_of(texel.curve, views, texel.pixels[i]));
}

void try_drawing(const Views& views, Texel& texel) {
    const auto [begin, end] = pixels_in(views.band, texel.pixels);
    for (std::size_t i = begin; i < end; ++i)
        texel.drawing.try_on(texel.curve, views, texel.pixels[i], texel.evidence[i]);
}

void write_map(const AlbedoMap& albedo, const Texel& texel, int row, ShadingMaps& maps) {
    const cv::Vec3d mean = mean_albedo(albedo, texel.pixels);
    maps.mean_albedo(row, 0) = mean;
    for (int level = 0; level < maps.levels; ++level) {
        const double r = static_cast<double>(level) / (maps.levels - 1);
        for (int c = 0; c < 3; ++c)
            maps.radiance(row, level)[c] = static_cast<float>(std::max(0.0, mean[c]) * r * texel.curve.gain[level][c]);
        maps.samples(row, level) = texel.curve.samples[level];
    }
}

void write_albedo(const Texel& texel, AlbedoMap& albedo) {
    for (std::size_t i = 0; i < texel.pixels.size(); ++i)
        for (int c = 0; c < 3; ++c)
            if (texel.evidence[i].tells(c))
                albedo.albedo(texel.pixels[i])[c] = static_cast<float>(texel.drawing.albedo(texel.evidence[i], c));
}

void require_running(const WorkContext& work) {
    if (work.cancelled()) throw Cancelled("the shading maps were stopped", "start it again when it suits");
}

/// Passes over the photographs by bands, each read while the one before it is used; one that holds them all stays.
class Passes {
public:
    Passes(PhotoSource& photos, int band_rows, const WorkContext& work)
        : photos_(photos), band_rows_(std::min(band_rows, photos.size().height)), work_(work) {}

    template <class Visit>
    void pass(Visit&& visit) {
        const int height = photos_.size().height;
        if (band_rows_ < height || passes_ == 0) {
            if (passes_ > 0) photos_.rewind();
            photos_.read_next(band_rows_, current_);
        }
        for (int seen = 0; seen < height; std::swap(current_, next_)) {
            require_running(work_);
            const std::size_t rows = static_cast<std::size_t>(height);
            work_.tell({"shading", passes_ * rows + static_cast<std::size_t>(seen), all_passes * rows, {}});
            seen += current_.rows();
            const int coming = std::min(band_rows_, height - seen);
            if (coming > 0)
                tbb::parallel_invoke([&] { photos_.read_next(coming, next_); }, [&] { visit(current_); });
            else
                visit(current_);
            if (band_rows_ == height) break;
        }
        require_running(work_);
        ++passes_;
    }

private:
    static constexpr std::size_t all_passes = 3;

    PhotoSource& photos_;
    int band_rows_;
    const WorkContext& work_;
    PhotoBand current_, next_;
    std::size_t passes_ = 0;
};

/// What is held beside the photographs: the maps given and made, and what is known of texels and their pixels.
std::size_t bytes_of_maps(const IndexMap& index, int levels) {
    const std::size_t maps = 3 * (sizeof(cv::Vec3f) + sizeof(uchar)) + sizeof(ushort);
    return static_cast<std::size_t>(index.label.size().area()) * maps +
           static_cast<std::size_t>(cv::countNonZero(index.label)) * Texel::bytes_per_pixel +
           static_cast<std::size_t>(index.texels) * Texel::bytes(levels);
}

int band_rows_of(const PhotoSource& photos, const IndexMap& index, int levels, const ShadingBands& bands) {
    if (bands.rows > 0) return bands.rows;
    const std::size_t held = bytes_of_maps(index, levels);
    const int by_bands = rows_within(photos, held, bands.memory_mib);
    const std::size_t whole = static_cast<std::size_t>(photos.size().height) * photos.bytes_per_row();
    const bool fits = held + photos.bytes_held() + whole <= static_cast<std::size_t>(bands.memory_mib) << 20;
    return fits ? photos.size().height : by_bands;
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

void require_inputs(const PhotoSource& photos, const Lights& lights, const NormalMap& normals, const AlbedoMap& albedo,
                    const IndexMap& index, const SceneGeometry& geometry) {
    if (lights.size() != photos.count())
        throw InputError(fmt::format("there are {} photographs but {} lights", photos.count(), lights.size()),
                         "give one light for each photograph, in the same order");
    require_lights(lights);
    require_intensities(lights);
    require_size("the normal map", normals.normal.size(), photos.size());
    require_size("the normal map's mask", normals.valid.size(), photos.size());
    require_size("the albedo map", albedo.albedo.size(), photos.size());
    require_size("the albedo map's mask", albedo.valid.size(), photos.size());
    require_size("the index map", index.label.size(), photos.size());
    require_labels(index);
    require_geometry(lights, geometry, photos.size());
    if (index.texels < 1) throw InputError("the index map has no texels", "compute the texels first");
}

}  // namespace

void ShadingOptions::validate() const {
    if (levels < 2 || levels > 256)
        throw InputError(fmt::format("shading: levels is {}, allowed are 2...256", levels),
                         "set levels within that range");
}

void ShadingBands::validate() const {
    if (memory_mib < 1) throw InputError(fmt::format("memory_mib is {}", memory_mib), "allowed: 1 or more");
    if (rows < 0) throw InputError(fmt::format("rows is {}", rows), "allowed: 1 or more, or 0 for as many as fit");
}

ShadingResult shading_maps(PhotoSource& photos, const Lights& lights, const NormalMap& normals, const AlbedoMap& albedo,
                           const IndexMap& index, const ShadingOptions& options, const ShadingBands& bands,
                           const WorkContext& work) {
    const auto start = std::chrono::steady_clock::now();
    options.validate();
    bands.validate();
    require_inputs(photos, lights, normals, albedo, index, options.geometry);
    const int band_rows = band_rows_of(photos, index, options.levels, bands);

    ShadingResult result;
    ShadingMaps& maps = result.maps;
    maps.texels = index.texels;
    maps.levels = options.levels;
    maps.radiance = cv::Mat3f(maps.texels, maps.levels);
    maps.samples = cv::Mat1i(maps.texels, maps.levels);
    maps.mean_albedo = cv::Mat3f(maps.texels, 1);
    result.albedo = {albedo.albedo.clone(), albedo.valid.clone()};

    std::vector<Texel> texels;
    texels.reserve(static_cast<std::size_t>(maps.texels));
    for (Pixels& pixels : pixels_by_texel(index, albedo)) texels.emplace_back(std::move(pixels), maps.levels);
    on_threads_of(work, [&] {
        Passes passes(photos, band_rows, work);
        const auto pass = [&](auto&& visit) {
            passes.pass([&](const PhotoBand& band) {
                const Views views{band, lights, normals, albedo, options.geometry};
                tbb::parallel_for(std::size_t{0}, texels.size(), [&](std::size_t k) {
                    if (!work.cancelled()) visit(views, texels[k]);
                });
            });
        };
        const auto each = [&](auto&& finish) {
            tbb::parallel_for(std::size_t{0}, texels.size(), [&](std::size_t k) { finish(k, texels[k]); });
        };
        pass(add_samples);
        each([&](std::size_t k, Texel& texel) {
            texel.curve = texel.estimator.curve();
            write_map(albedo, texel, static_cast<int>(k), maps);
            texel.evidence.reserve(texel.pixels.size());
        });
        pass(add_evidence);
        each([](std::size_t, Texel& texel) { texel.drawing.set_mean(texel.evidence); });
        pass(try_drawing);
        each([&](std::size_t, Texel& texel) {
            texel.drawing.choose();
            write_albedo(texel, result.albedo);
        });
    });
    work.tell({"shading", 1, 1, {}});
    result.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    return result;
}

ShadingResult shading_maps(const PhotoStack& stack, const Lights& lights, const NormalMap& normals,
                           const AlbedoMap& albedo, const IndexMap& index, const ShadingOptions& options,
                           const WorkContext& work) {
    PhotosInMemory photos(stack);
    ShadingBands whole;
    whole.rows = photos.size().height;
    return shading_maps(photos, lights, normals, albedo, index, options, whole, work);
}

}  // namespace darkbox
