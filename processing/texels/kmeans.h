#pragma once

#include <cstdint>
#include <opencv2/core.hpp>
#include <vector>

namespace darkbox {

struct KMeansOptions {
    int clusters = 8;     ///< at least 1
    int iterations = 30;  ///< of Lloyd's algorithm, at most; at least 1
    std::uint64_t seed = 1;
};

struct KMeansResult {
    std::vector<int> label;  ///< of each point: its row in `centres`. Every centre has at least one point
    cv::Mat1f centres;       ///< the means; fewer rows than asked for where fewer points differ
    double inertia = 0;      ///< sum of squared distances of the points to their centres
    int iterations = 0;      ///< done
};

/// Lloyd's k-means with greedy k-means++ seeding (Arthur and Vassilvitskii 2007; of several candidates the one that
/// lowers the potential most). A cluster that loses its last point starts anew at the point farthest from its centre.
/// `points` holds one finite point in each row, at least one. Bit-identical on any number of threads; parallel through
/// TBB in the caller's arena.
KMeansResult kmeans(const cv::Mat1f& points, const KMeansOptions& options);

}  // namespace darkbox
