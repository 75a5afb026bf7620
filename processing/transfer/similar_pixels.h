#pragma once

#include <cstdint>
#include <opencv2/core.hpp>
#include <span>
#include <vector>

namespace darkbox {

/// For each valid pixel of a source, the few elsewhere whose surroundings are most like its own (k-coherence, Tong et
/// al. 2002). Approximate; equal on any number of threads. Immutable after construction, thus thread-safe.
class SimilarPixels {
public:
    /// `bytes` are 8-bit pixels with a border of half a window on each side, `valid` is without it.
    SimilarPixels(const cv::Mat& bytes, const cv::Mat1b& valid, int window, std::uint64_t seed);

    std::span<const cv::Point> of(cv::Point p) const;

private:
    cv::Mat1i place_;               ///< of each valid pixel, in scan-line order
    std::vector<cv::Point> found_;  ///< `kept` for each
    std::vector<int> count_;
};

}  // namespace darkbox
