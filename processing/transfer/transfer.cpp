#include "processing/transfer/transfer.h"

#include <fmt/format.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_invoke.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <utility>

#include "acquisition/frame/error.h"
#include "processing/maps/parallel.h"
#include "processing/maps/require.h"
#include "processing/transfer/analogies.h"
#include "processing/transfer/coverage.h"
#include "processing/transfer/measures.h"
#include "processing/transfer/patch_energy.h"
#include "processing/transfer/patchmatch.h"
#include "processing/transfer/preview.h"
#include "processing/transfer/pyramid.h"
#include "processing/transfer/relief.h"

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

void require_control(const ControlMaps& control, const TransferSource& source, const NormalMap& target,
                     const TransferOptions& options) {
    if (control.source.empty() && control.target.empty()) return;
    if (options.method != TransferMethod::patchmatch)
        throw InputError("control maps guide the method patchmatch only", "choose that method, or leave them out");
    require_size("the source's control map", control.source.size(), source.normals.valid.size());
    require_size("the target's control map", control.target.size(), target.valid.size());
    for (const cv::Mat3f* map : {&control.source, &control.target})
        if (!cv::checkRange(*map))
            throw InputError("a control map has values that are not finite", "draw it again, with values of 0...1");
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

AlbedoMap read_albedo(const AlbedoMap& source, const cv::Mat2i& coordinates, const cv::Mat1b& valid) {
    AlbedoMap result{cv::Mat3f(valid.size()), valid.clone()};
    tbb::parallel_for(0, valid.rows, [&](int y) {
        for (int x = 0; x < valid.cols; ++x)
            result.albedo(y, x) = valid(y, x) ? source.albedo(cv::Point(coordinates(y, x))) : cv::Vec3f(0, 0, 0);
    });
    return result;
}

IndexMap read_index(const IndexMap& source, const cv::Mat2i& coordinates, const cv::Mat1b& valid) {
    if (source.texels == 0) return {};
    IndexMap result{cv::Mat1w(valid.size(), std::uint16_t{0}), source.texels};
    tbb::parallel_for(0, valid.rows, [&](int y) {
        for (int x = 0; x < valid.cols; ++x)
            if (valid(y, x)) result.label(y, x) = source.label(cv::Point(coordinates(y, x)));
    });
    return result;
}

/// Tells each finished pass of patchmatch, and stops the work when that is asked for.
PassesDone tell_passes(const WorkContext& work) {
    return [&work](int done, int all) {
        if (work.cancelled()) throw Cancelled("texture transfer was cancelled", "start it again when you like");
        work.tell({"transfer", static_cast<std::size_t>(done), static_cast<std::size_t>(all), {}});
    };
}

/// The control map as a level of its own, so that it is halved like the others.
MapPyramid control_pyramid(const cv::Mat3f& control, const MapLevel& level, int levels) {
    if (control.empty()) return {};
    MapLevel guide{level.normal, cv::Mat3f(level.normal.size(), cv::Vec3f(0, 0, 0)), level.valid};
    control.copyTo(guide.albedo, level.valid);
    return map_pyramid(guide, levels);
}

cv::Mat2i coordinates_by(const MapLevel& source, const MapLevel& target, const ControlMaps& control, float white,
                         const TransferOptions& options, const WorkContext& work) {
    const cv::Size sizes[] = {source.valid.size(), target.valid.size()};
    switch (options.method) {
        case TransferMethod::analogies: {
            const int levels = pyramid_levels(options.levels, sizes[0], sizes[1]);
            return analogies(map_pyramid(source, levels), map_pyramid(target, levels), white, options, work);
        }
        case TransferMethod::patchmatch: {
            const int levels = patchmatch_levels(options.levels, sizes[0], sizes[1]);
            const GuidedPyramid sources{map_pyramid(source, levels), control_pyramid(control.source, source, levels)};
            const GuidedPyramid targets{map_pyramid(target, levels), control_pyramid(control.target, target, levels)};
            const TexelCode code{white, options.normal_weight, options.control_weight, !control.source.empty()};
            return patchmatch(sources, targets, code, options, tell_passes(work));
        }
        case TransferMethod::preview:
            return preview(source, target, options);
    }
    return {};
}

/// The low-passed pair that coordinates are synthesised from.
struct Guides {
    MapLevel from;
    MapLevel onto;
    float white = 1;
};

Guides guides_of(const TransferSource& source, const NormalMap& target, double sigma) {
    Guides guides;
    tbb::parallel_invoke(
        [&] {
            guides.from = source_level(source, sigma);
            guides.white = white_level({guides.from.albedo, guides.from.valid});
        },
        [&] { guides.onto = target_level(target, sigma); });
    return guides;
}

/// The same measures as measures.h takes of anybody's result, on a coarser grid. Those that cost memory come after the
/// guides are gone.
void measure(const TransferSource& source, const NormalMap& target, Guides guides, int window, TransferResult& result) {
    result.uncovered_deg = uncovered_deg(guides.from, guides.onto);
    result.coverage_deg =
        coverage_deg({guides.from.normal, guides.from.valid}, {guides.onto.normal, guides.onto.valid});
    guides = {};
    result.coherence = coherence(result.coordinates);
    if (const auto angle = angles(source.normals, target, result.coordinates)) result.guide_error_deg = angle->mean_deg;
    const float white = source.white.value_or(white_level(source.albedo));
    PatchLayers from, onto;
    {
        const Appearance shown = appearance_of(source.normals, source.albedo, white);
        const Appearance moved = appearance_of(target, result.albedo, white);
        result.histogram_distance = histogram_distance(shown, moved);
        from = colour_patches(shown, window);
        onto = colour_patches(moved, window);
    }
    // About a thousand patches, so that it costs little next to the synthesis at any size.
    const int sparse = std::max(16, std::max(target.valid.cols, target.valid.rows) / 32);
    result.patch_energy = patch_energy(from, onto, window, sparse);
}

TransferResult transferred(const TransferSource& source, const NormalMap& target, const ControlMaps& control,
                           const TransferOptions& options, const WorkContext& work) {
    const auto start = std::chrono::steady_clock::now();
    Guides guides = guides_of(source, target, options.normal_sigma);
    TransferResult result;
    result.coordinates = coordinates_by(guides.from, guides.onto, control, guides.white, options, work);
    result.albedo = read_albedo(source.albedo, result.coordinates, target.valid);
    result.index = read_index(source.index, result.coordinates, target.valid);
    result.normals = moved_relief(source.normals, guides.from, result.coordinates, target);
    result.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    measure(source, target, std::move(guides), options.window, result);
    return result;
}

}  // namespace

TransferResult transfer_texture(const TransferSource& source, const NormalMap& target, const TransferOptions& options,
                                const WorkContext& work, const ControlMaps& control) {
    options.validate();
    require_input(source, target);
    require_control(control, source, target, options);
    return on_threads_of(work, [&] { return transferred(source, target, control, options, work); });
}

}  // namespace darkbox
