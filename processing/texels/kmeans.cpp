#include "processing/texels/kmeans.h"

#include <algorithm>
#include <numeric>

#include "processing/texels/lloyd.h"
#include "processing/texels/random.h"
#include "processing/texels/seeding.h"

namespace darkbox {
namespace {

constexpr int sample_size = 16384;
constexpr int sample_iterations = 10;

std::vector<int> all_of(const PointSource& points) {
    std::vector<int> all(points.count());
    std::iota(all.begin(), all.end(), 0);
    return all;
}

/// One point drawn from each of equally long runs.
std::vector<int> even_sample(const PointSource& points, std::uint64_t seed) {
    if (points.count() <= sample_size) return all_of(points);
    SplitMix64 random(seed);
    std::vector<int> sample(sample_size);
    const double run = static_cast<double>(points.count()) / sample_size;
    for (int i = 0; i < sample_size; ++i)
        sample[i] = std::min(points.count() - 1, static_cast<int>((i + random.uniform()) * run));
    return sample;
}

cv::Mat1f rows_of(const PointSource& points, const std::vector<int>& chosen) {
    cv::Mat1f rows(static_cast<int>(chosen.size()), points.dimensions());
    points.read(chosen, rows[0]);
    return rows;
}

/// Good places to start from, found on a sample.
cv::Mat1f first_centres(const PointSource& points, const KMeansOptions& options) {
    const cv::Mat1f sample = rows_of(points, even_sample(points, options.seed));
    const cv::Mat1f seeds = seed_centres(sample, options.clusters, options.seed);
    if (sample.rows == points.count()) return seeds;
    // Where few points differ, the sample may have missed some.
    if (seeds.rows < options.clusters)
        return seed_centres(rows_of(points, all_of(points)), options.clusters, options.seed);
    const MatrixPoints sampled(sample);
    Lloyd lloyd(sampled, seeds);
    for (int i = 0; i < std::min(sample_iterations, options.iterations) && lloyd.iterate(); ++i) {
    }
    return lloyd.centres();
}

}  // namespace

KMeansResult kmeans(const PointSource& points, const KMeansOptions& options) {
    Lloyd lloyd(points, first_centres(points, options));
    int done = 0;
    bool changed = true;
    while (changed && done < options.iterations) {
        changed = lloyd.iterate();
        ++done;
    }
    return {lloyd.labels(), lloyd.centres(), lloyd.inertia(), done};
}

}  // namespace darkbox
