#include "processing/normals/photometric_stereo.h"

#include <fmt/format.h>
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <chrono>
#include <cmath>
#include <vector>

#include "acquisition/frame/error.h"
#include "processing/maps/parallel.h"
#include "processing/normals/least_squares.h"
#include "processing/normals/light_set.h"

namespace darkbox {
namespace {

void require_matching(const PhotoStack& stack, const Lights& lights) {
    require_consistent(stack);
    if (lights.size() != stack.images.size())
        throw InputError(fmt::format("there are {} photographs but {} lights", stack.images.size(), lights.size()),
                         "give one light for each photograph, in the same order");
}

/// Every row once, on as many threads as asked for. A row's sums have a place of their own, so that adding them up
/// afterwards does not depend on which thread came first.
std::vector<RowSums> solve_rows(const PhotoStack& stack, const LightSet& set, const PhotometricStereoOptions& options,
                                const WorkContext& work, SolvedMaps& maps) {
    std::vector<RowSums> sums(static_cast<std::size_t>(stack.mask.rows));
    on_threads_of(work, [&] {
        tbb::parallel_for(tbb::blocked_range<int>(0, stack.mask.rows), [&](const tbb::blocked_range<int>& rows) {
            for (int row = rows.begin(); row < rows.end() && !work.cancelled(); ++row)
                sums[static_cast<std::size_t>(row)] =
                    solve_row_least_squares(stack, set, options.min_albedo, row, maps);
        });
    });
    if (work.cancelled()) throw Cancelled("photometric stereo was cancelled", "run it again to get normals");
    return sums;
}

RowSums total(const std::vector<RowSums>& rows) {
    RowSums sum;
    for (const RowSums& row : rows) {
        sum.squared_residual += row.squared_residual;
        sum.samples += row.samples;
        sum.pixels += row.pixels;
        sum.not_finite += row.not_finite;
    }
    return sum;
}

}  // namespace

void PhotometricStereoOptions::validate() const {
    if (!(std::isfinite(min_albedo) && min_albedo >= 0.0F))
        throw InputError(fmt::format("min_albedo is {}", min_albedo), "allowed: 0 or more (1.0 = full scale)");
}

PhotometricStereoResult photometric_stereo(const PhotoStack& stack, const Lights& lights,
                                           const PhotometricStereoOptions& options, const WorkContext& work) {
    options.validate();
    require_matching(stack, lights);
    const LightSet set = LightSet::from(lights);

    const auto start = std::chrono::steady_clock::now();
    const auto rows = static_cast<std::size_t>(stack.mask.rows);
    work.tell({"normals", 0, rows, ""});
    SolvedMaps maps(stack.size());
    const RowSums sums = total(solve_rows(stack, set, options, work, maps));
    work.tell({"normals", rows, rows, ""});

    PhotometricStereoResult result;
    result.normals = {maps.normal, maps.valid};
    result.albedo = {maps.albedo, maps.valid.clone()};
    result.residual = maps.residual;
    result.lights_used = maps.lights_used;
    result.pixels = sums.pixels;
    result.not_finite = sums.not_finite;
    if (sums.samples > 0) result.residual_rms = std::sqrt(sums.squared_residual / static_cast<double>(sums.samples));
    result.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    return result;
}

}  // namespace darkbox
