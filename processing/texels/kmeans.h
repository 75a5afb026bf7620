#pragma once

#include <cstdint>
#include <opencv2/core.hpp>
#include <vector>

#include "processing/texels/points.h"

namespace darkbox {

struct KMeansOptions {
    int clusters = 8;     ///< at least 1
    int iterations = 30;  ///< of Lloyd's algorithm over all points, at most; at least 1
    std::uint64_t seed = 1;
};

struct KMeansResult {
    std::vector<int> label;  ///< of each point: its row in `centres`. Every centre has at least one point
    cv::Mat1f centres;       ///< the means; fewer rows than asked for where fewer points differ
    double inertia = 0;      ///< sum of squared distances of the points to their centres
    int iterations = 0;      ///< done
};

/// Lloyd's k-means. Seeds and a first few iterations come from an even sample of at most 16384 points; a point whose
/// bounds say that its centre is still the nearest is passed over (Hamerly 2010, "Making k-means even faster", section
/// 3), which changes time, not labels. A cluster that loses its last point starts anew at the point farthest from its
/// centre. `points` has at least one. Bit-identical on any number of threads, and on all processors with fused
/// multiplication and addition; parallel through TBB in the caller's arena.
KMeansResult kmeans(const PointSource& points, const KMeansOptions& options);

}  // namespace darkbox
