#include "processing/texels/kmeans.h"

#include <algorithm>
#include <numeric>
#include <string>
#include <unordered_set>
#include <vector>

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

/// The points that differ from each other, in their order, as many as a sample has at most. A block of points is in
/// memory at a time.
cv::Mat1f distinct_points(const PointSource& points) {
    const auto bytes = static_cast<std::size_t>(points.dimensions()) * sizeof(float);
    std::unordered_set<std::string> seen;
    std::vector<int> chosen;
    for (int first = 0; first < points.count(); first += sample_size) {
        std::vector<int> block(std::min(sample_size, points.count() - first));
        std::iota(block.begin(), block.end(), first);
        const cv::Mat1f rows = rows_of(points, block);
        for (int i = 0; i < rows.rows && seen.size() < sample_size; ++i)
            if (seen.emplace(reinterpret_cast<const char*>(rows[i]), bytes).second) chosen.push_back(block[i]);
    }
    return rows_of(points, chosen);
}

/// Good places to start from, found on a sample.
cv::Mat1f first_centres(const PointSource& points, const KMeansOptions& options) {
    const cv::Mat1f sample = rows_of(points, even_sample(points, options.seed));
    const cv::Mat1f seeds = seed_centres(sample, options.clusters, options.seed);
    if (sample.rows == points.count()) return seeds;
    // Where few points differ, the sample may have missed some.
    if (seeds.rows < options.clusters) return seed_centres(distinct_points(points), options.clusters, options.seed);
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
