#include "processing/normals/median_variance.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_reduce.h>

#include <algorithm>
#include <bit>
#include <cstdint>
#include <functional>
#include <numeric>
#include <vector>

namespace darkbox {
namespace {

/// Numbers that are not negative sort as their bits do: buckets of neighbouring ones by the upper half of those.
using Counts = std::vector<std::size_t>;
constexpr std::size_t buckets = 1 << 16;
std::size_t bucket_of(float value) { return std::bit_cast<std::uint32_t>(value) >> 16; }

/// Calls `take` with each variance of the row that tells something.
template <class Take>
void visit_variances(const SolvedMaps& maps, int row, Take take) {
    for (int x = 0; x < maps.valid.cols; ++x)
        if (const int used = maps.lights_used(row, x); maps.valid(row, x) && used > 3)
            take(maps.residual(row, x) * maps.residual(row, x) * static_cast<float>(used) /
                 static_cast<float>(used - 3));
}

/// Every such row tells enough.
int row_step(const SolvedMaps& maps) {
    constexpr std::size_t enough_pixels = 1 << 20;
    return static_cast<int>(std::max<std::size_t>(1, maps.valid.total() / enough_pixels));
}

Counts counts_by_bucket(const SolvedMaps& maps, int step) {
    return tbb::parallel_reduce(
        tbb::blocked_range<int>(0, (maps.valid.rows + step - 1) / step, 256), Counts(buckets, 0),
        [&](const tbb::blocked_range<int>& rows, Counts counts) {
            for (int row = rows.begin(); row < rows.end(); ++row)
                visit_variances(maps, row * step, [&](float variance) { ++counts[bucket_of(variance)]; });
            return counts;
        },
        [](Counts a, const Counts& b) {
            std::transform(a.begin(), a.end(), b.begin(), a.begin(), std::plus<>());
            return a;
        });
}

}  // namespace

float median_variance(const SolvedMaps& maps) {
    const int step = row_step(maps);
    const Counts counts = counts_by_bucket(maps, step);
    std::size_t rank = std::accumulate(counts.begin(), counts.end(), std::size_t{0}) / 2, bucket = 0;
    for (; bucket < buckets && rank >= counts[bucket]; ++bucket) rank -= counts[bucket];
    if (bucket == buckets) return 0;
    std::vector<float> near_median;
    near_median.reserve(counts[bucket]);
    for (int row = 0; row < maps.valid.rows; row += step)
        visit_variances(maps, row, [&](float variance) {
            if (bucket_of(variance) == bucket) near_median.push_back(variance);
        });
    const auto middle = near_median.begin() + static_cast<std::ptrdiff_t>(rank);
    std::nth_element(near_median.begin(), middle, near_median.end());
    return *middle;
}

}  // namespace darkbox
