#include "processing/normals/sample_model.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include "processing/normals/law_search.h"
#include "processing/normals/pixel_sample.h"
#include "processing/normals/pixel_solver.h"

namespace darkbox {
namespace {

constexpr double pairs_wanted = 12000;  ///< over the whole picture, most of them beside the object
constexpr std::size_t most_pixels_of_law = 1000;
constexpr std::size_t classes = 8;
constexpr std::size_t least_lights_of_law = 7;
constexpr double sigma_per_median = 1.4826;

/// Two pixels side by side, before any noise is known.
struct Pair {
    int row = 0, column = 0;
    std::array<PixelSamples, 2> pixels;
};

int grid_step(cv::Size picture) {
    return std::max(1, static_cast<int>(std::floor(std::sqrt(static_cast<double>(picture.area()) / pairs_wanted))));
}

void collect(const PhotoBand& band, const LightField& field, int step, std::vector<Pair>& pairs) {
    SampleRow samples;
    std::vector<Arrival> arrivals;
    for (int row = 0; row < band.rows(); ++row) {
        const int picture_row = band.first_row + row;
        if (picture_row % step != step / 2) continue;
        samples.load(band, field.set(), row);
        for (int column = step / 2; column + 1 < band.cols(); column += step) {
            const auto outside = [&](int x) { return !band.mask.empty() && band.mask(row, x) == 0; };
            if (outside(column) || outside(column + 1)) continue;
            if (!samples.finite(column) || !samples.finite(column + 1)) continue;
            Pair pair{picture_row, column, {}};
            for (int side = 0; side < 2; ++side) {
                field.arrivals(picture_row, column + side, arrivals);
                PixelSamples& pixel = pair.pixels[static_cast<std::size_t>(side)];
                samples.fill(field, arrivals, {}, column + side, pixel);
                pixel.view = field.to_camera(picture_row, column + side);
            }
            pairs.push_back(std::move(pair));
        }
    }
}

/// All pairs of the grid that lie on the object.
std::vector<Pair> read_pairs(PhotoSource& photos, const LightField& field, int band_rows, const WorkContext& work) {
    const int rows = photos.size().height, step = grid_step(photos.size());
    std::vector<Pair> pairs;
    PhotoBand band;
    bool mask_known = true;
    for (int row = 0; row < rows && !work.cancelled(); row += band.rows()) {
        photos.read_next(std::min(band_rows, rows - row), band);
        mask_known = mask_known && !band.mask.empty();
        collect(band, field, step, pairs);
    }
    if (!mask_known && !work.cancelled()) {
        const cv::Mat1b mask = photos.mask();
        std::erase_if(pairs, [&](const Pair& p) { return !mask(p.row, p.column) || !mask(p.row, p.column + 1); });
    }
    photos.rewind();
    return pairs;
}

/// A sample pair's radiance and half the squared difference of its residuals, as the photograph's radiance.
struct Difference {
    double radiance = 0;
    double squared = 0;
};

std::vector<Difference> differences(const std::vector<Pair>& pairs, const LightField& field) {
    static const BodyFactor lambert{BodyLaw{}};
    std::vector<std::vector<Difference>> of_pair(pairs.size());
    tbb::parallel_for(std::size_t{0}, pairs.size(), [&](std::size_t i) {
        std::array<PixelSolver, 2> solvers;
        int used = std::numeric_limits<int>::max();
        for (std::size_t side = 0; side < 2; ++side) {
            solvers[side].samples = pairs[i].pixels[side];
            const auto fit = solvers[side].solve(lambert);
            used = std::min(used, fit ? fit->used : 0);
        }
        if (used <= 3) return;
        const double freedom = (used - 3.0) / used;
        for (std::size_t k = 0; k < field.size(); ++k) {
            if (!(solvers[0].weights()[k] > 0) || !(solvers[1].weights()[k] > 0)) continue;
            const auto intensity = static_cast<double>(mean_intensity(field.set().lights[k]));
            const auto mean = 0.5 * static_cast<double>(pairs[i].pixels[0].value[k] + pairs[i].pixels[1].value[k]);
            const double d = static_cast<double>(solvers[0].residual(k) - solvers[1].residual(k)) * intensity;
            of_pair[i].push_back({mean * intensity, 0.5 * d * d / freedom});
        }
    });
    std::vector<Difference> all;
    for (const auto& some : of_pair) all.insert(all.end(), some.begin(), some.end());
    return all;
}

/// A line through the classes' variances, each weighed by its own inverse square: relative errors count alike. Neither
/// the line's start nor its slope may be negative.
NoiseModel line_through(const std::vector<Difference>& points) {
    double w = 0, x = 0, y = 0, xx = 0, xy = 0;
    for (const Difference& p : points) {
        const double weight = 1.0 / std::max(p.squared * p.squared, 1e-24);
        w += weight;
        x += weight * p.radiance;
        y += weight * p.squared;
        xx += weight * p.radiance * p.radiance;
        xy += weight * p.radiance * p.squared;
    }
    NoiseModel noise;
    if (!(w > 0)) return noise;
    const double spread = w * xx - x * x;
    double slope = spread > 0 ? (w * xy - x * y) / spread : 0.0;
    double start = (y - slope * x) / w;
    if (slope < 0 || !(spread > 0)) slope = 0, start = y / w;
    if (start < 0) start = 0, slope = xx > 0 ? xy / xx : 0.0;
    noise.read_sigma = std::sqrt(std::max(start, 0.0));
    noise.shot_gain = std::max(slope, 0.0);
    return noise;
}

NoiseModel noise_of_differences(const std::vector<Pair>& pairs, const LightField& field) {
    std::vector<Difference> all = differences(pairs, field);
    std::stable_sort(all.begin(), all.end(),
                     [](const Difference& a, const Difference& b) { return a.radiance < b.radiance; });
    std::vector<Difference> points;
    for (std::size_t c = 0; c < classes; ++c) {
        const auto first = all.begin() + static_cast<std::ptrdiff_t>(all.size() * c / classes);
        const auto last = all.begin() + static_cast<std::ptrdiff_t>(all.size() * (c + 1) / classes);
        if (last - first < 8) continue;
        const double radiance = (first + (last - first) / 2)->radiance;
        std::nth_element(first, first + (last - first) / 2, last, [](const Difference& a, const Difference& b) {
            return a.squared != b.squared ? a.squared < b.squared : a.radiance < b.radiance;
        });
        points.push_back({radiance, sigma_per_median * sigma_per_median * (first + (last - first) / 2)->squared});
    }
    return line_through(points);
}

void put_noise(const NoiseModel& noise, const LightField& field, PixelSamples& pixel) {
    for (std::size_t k = 0; k < pixel.size(); ++k) {
        const auto intensity = static_cast<double>(mean_intensity(field.set().lights[k]));
        pixel.noise_variance[k] = static_cast<float>(noise.variance(static_cast<double>(pixel.value[k]) * intensity) /
                                                     (intensity * intensity));
    }
}

/// In a fit that knows no noise, what is noisy spoils the residuals of what is not: a second round knows the first
/// one's.
NoiseModel find_noise(std::vector<Pair>& pairs, const LightField& field) {
    const NoiseModel first = noise_of_differences(pairs, field);
    for (Pair& pair : pairs)
        for (PixelSamples& pixel : pair.pixels) put_noise(first, field, pixel);
    return noise_of_differences(pairs, field);
}

/// Pixels spread over the grid, with their noise.
std::vector<PixelSamples> pixels_of_law(std::vector<Pair>& pairs, const NoiseModel& noise, const LightField& field) {
    std::vector<PixelSamples> pixels;
    const std::size_t step = (pairs.size() + most_pixels_of_law - 1) / most_pixels_of_law;
    for (std::size_t i = 0; i < pairs.size(); i += step) {
        pixels.push_back(pairs[i].pixels[0]);
        put_noise(noise, field, pixels.back());
    }
    return pixels;
}

}  // namespace

SampleModel find_sample_model(PhotoSource& photos, const LightField& field, const GivenModel& given, int band_rows,
                              const WorkContext& work) {
    SampleModel model{given.law.value_or(BodyLaw{}), {}, given.noise.value_or(NoiseModel{})};
    if (given.law && given.noise) return model;
    std::vector<Pair> pairs = read_pairs(photos, field, band_rows, work);
    if (!given.noise) model.noise = find_noise(pairs, field);
    if (!given.law && field.size() >= least_lights_of_law && field.known()) {
        const SurfaceLaw found = find_surface_law(pixels_of_law(pairs, model.noise, field));
        model.law = found.body;
        model.gloss = found.gloss;
    }
    return model;
}

}  // namespace darkbox
