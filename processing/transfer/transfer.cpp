#include "processing/transfer/transfer.h"

#include <fmt/format.h>

#include <chrono>
#include <cmath>
#include <utility>

#include "acquisition/frame/error.h"
#include "processing/maps/parallel.h"
#include "processing/maps/require.h"
#include "processing/transfer/features.h"
#include "processing/transfer/measures.h"
#include "processing/transfer/patch_energy.h"
#include "processing/transfer/pyramid.h"
#include "processing/transfer/refinement.h"
#include "processing/transfer/synthesis.h"

namespace darkbox {
namespace {

void require_normals(const char* whose, const NormalMap& map) {
    require_size(fmt::format("the {}'s mask", whose).c_str(), map.valid.size(), map.normal.size());
    for (int y = 0; y < map.valid.rows; ++y)
        for (int x = 0; x < map.valid.cols; ++x) {
            if (!map.valid(y, x)) continue;
            const cv::Vec3f& n = map.normal(y, x);
            const float length = std::sqrt(n.dot(n));
            if (!(length > 0) || !std::isfinite(length))
                throw InputError(fmt::format("the {}'s normal at ({}, {}) is ({}, {}, {}), which is no direction",
                                             whose, x, y, n[0], n[1], n[2]),
                                 "leave such pixels out of the mask, or compute the normals again");
        }
}

void require_finite(const AlbedoMap& map) {
    for (int y = 0; y < map.valid.rows; ++y)
        for (int x = 0; x < map.valid.cols; ++x) {
            const cv::Vec3f& v = map.albedo(y, x);
            if (map.valid(y, x) && !(std::isfinite(v[0]) && std::isfinite(v[1]) && std::isfinite(v[2])))
                throw InputError(fmt::format("the source's albedo at ({}, {}) is ({}, {}, {}), which is not finite", x,
                                             y, v[0], v[1], v[2]),
                                 "leave such pixels out of the mask, or compute the albedo again");
        }
}

void require_any(const char* whose, const cv::Mat1b& valid) {
    if (cv::countNonZero(valid) == 0)
        throw InputError(fmt::format("the {} has no valid pixel", whose),
                         "check its mask: it must be white on the object");
}

cv::Mat1b usable_pixels(const TransferSource& source) {
    cv::Mat1b usable;
    cv::bitwise_and(source.normals.valid, source.albedo.valid, usable);
    return usable;
}

void require_input(const TransferSource& source, const NormalMap& target) {
    const cv::Size size = source.normals.normal.size();
    require_normals("source", source.normals);
    require_size("the source's albedo", source.albedo.albedo.size(), size);
    require_size("the source's albedo mask", source.albedo.valid.size(), size);
    if (source.index.texels > 0) {
        require_size("the source's index map", source.index.label.size(), size);
        require_labels(source.index);
    }
    require_finite(source.albedo);
    require_normals("target", target);
    require_any("source", usable_pixels(source));
    require_any("target", target.valid);
}

/// Both of the source's maps over the pixels where both are valid.
MapLevel source_level(const TransferSource& source, double sigma) {
    NormalMap normals = source.normals;
    normals.valid = usable_pixels(source);
    const NormalMap smooth = low_pass(normals, sigma);
    MapLevel level{smooth.normal, cv::Mat3f(smooth.normal.size(), cv::Vec3f(0, 0, 0)), smooth.valid};
    source.albedo.albedo.copyTo(level.albedo, level.valid);
    return level;
}

MapLevel target_level(const NormalMap& target, double sigma) {
    const NormalMap smooth = low_pass(target, sigma);
    return {smooth.normal, cv::Mat3f(smooth.normal.size(), cv::Vec3f(0, 0, 0)), smooth.valid};
}

cv::Vec3f mean_albedo(const MapLevel& level) {
    const cv::Scalar mean = cv::mean(level.albedo, level.valid);
    return {static_cast<float>(mean[0]), static_cast<float>(mean[1]), static_cast<float>(mean[2])};
}

/// Tells each finished row of each level once, and stops the work when that is asked for.
class Progress {
public:
    Progress(const WorkContext& work, const MapPyramid& target) : work_(work) {
        for (const MapLevel& level : target) total_ += level.valid.rows;
    }

    void begin_level() { before_ += std::exchange(rows_, 0); }

    void check() const {
        if (work_.cancelled()) throw Cancelled("texture transfer was cancelled", "start it again when you like");
    }

    void rows_done(int rows) {
        check();
        if (rows == rows_) return;
        rows_ = rows;
        work_.tell({"transfer", static_cast<std::size_t>(before_ + rows_), static_cast<std::size_t>(total_), {}});
    }

private:
    const WorkContext& work_;
    int total_ = 0;
    int before_ = 0;
    int rows_ = 0;
};

cv::Mat2i synthesise(const MapPyramid& source, MapPyramid& target, const FeatureSpace& space, float white,
                     const TransferOptions& options, const WorkContext& work) {
    const MapLevel& finest = source.front();
    const ExpectedLook look(appearance_of({finest.normal, finest.valid}, {finest.albedo, finest.valid}, white));
    Progress progress(work, target);
    cv::Mat2i coordinates;
    const int coarsest = static_cast<int>(source.size()) - 1;
    for (int level = coarsest; level >= 0; --level) {
        progress.begin_level();
        const bool has_coarser = level < coarsest;
        coordinates = synthesise_level(
            {source[level], has_coarser ? &source[level + 1] : nullptr, target[level],
             has_coarser ? &target[level + 1] : nullptr, coordinates, std::ldexp(options.kappa, -level)},
            space, options.seed, [&](int rows) { progress.rows_done(rows); });
        coordinates = refine_level({source[level], target[level], look, level, white}, coordinates, options,
                                   [&] { progress.check(); });
    }
    return coordinates;
}

AlbedoMap read_albedo(const AlbedoMap& source, const cv::Mat2i& coordinates, const cv::Mat1b& valid) {
    AlbedoMap result{cv::Mat3f(valid.size(), cv::Vec3f(0, 0, 0)), valid.clone()};
    for (int y = 0; y < valid.rows; ++y)
        for (int x = 0; x < valid.cols; ++x)
            if (valid(y, x)) result.albedo(y, x) = source.albedo(cv::Point(coordinates(y, x)));
    return result;
}

IndexMap read_index(const IndexMap& source, const cv::Mat2i& coordinates, const cv::Mat1b& valid) {
    if (source.texels == 0) return {};
    IndexMap result{cv::Mat1w(valid.size(), std::uint16_t{0}), source.texels};
    for (int y = 0; y < valid.rows; ++y)
        for (int x = 0; x < valid.cols; ++x)
            if (valid(y, x)) result.label(y, x) = source.label(cv::Point(coordinates(y, x)));
    return result;
}

TransferResult transferred(const TransferSource& source, const NormalMap& target, const TransferOptions& options,
                           const WorkContext& work) {
    const int levels = pyramid_levels(options.levels, source.normals.valid.size(), target.valid.size());
    const MapPyramid sources = map_pyramid(source_level(source, options.normal_sigma), levels);
    MapPyramid targets = map_pyramid(target_level(target, options.normal_sigma), levels);
    const AlbedoMap exemplar{sources.front().albedo, sources.front().valid};
    const float white = white_level(exemplar);
    const FeatureSpace space(options, white, mean_albedo(sources.front()));

    TransferResult result;
    result.coordinates = synthesise(sources, targets, space, white, options, work);
    result.albedo = read_albedo(source.albedo, result.coordinates, target.valid);
    result.index = read_index(source.index, result.coordinates, target.valid);
    result.coverage_deg =
        coverage_deg({sources.front().normal, sources.front().valid}, {targets.front().normal, targets.front().valid});
    result.coherence = coherence(result.coordinates);
    const Appearance shown = appearance_of({sources.front().normal, sources.front().valid}, exemplar, white);
    const Appearance moved = appearance_of(target, result.albedo, white);
    constexpr int sparse = 16;  // so that it costs little next to the synthesis
    result.patch_energy = patch_energy(colour_patches(shown, options.window), colour_patches(moved, options.window),
                                       options.window, sparse)
                              .value_or(0);
    result.histogram_distance = histogram_distance(shown, moved).value_or(0);
    return result;
}

}  // namespace

TransferResult transfer_texture(const TransferSource& source, const NormalMap& target, const TransferOptions& options,
                                const WorkContext& work) {
    const auto start = std::chrono::steady_clock::now();
    options.validate();
    require_input(source, target);
    TransferResult result = on_threads_of(work, [&] { return transferred(source, target, options, work); });
    result.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    return result;
}

}  // namespace darkbox
