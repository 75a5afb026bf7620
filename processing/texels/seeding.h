#pragma once

#include <cstdint>
#include <opencv2/core.hpp>

namespace darkbox {

/// Greedy k-means++ (Arthur and Vassilvitskii 2007; of eight candidates the one that lowers the potential most).
/// `points` has one point in each row. As many rows as asked for, or as points differ. Bit-identical on any number of
/// threads.
cv::Mat1f seed_centres(const cv::Mat1f& points, int clusters, std::uint64_t seed);

}  // namespace darkbox
