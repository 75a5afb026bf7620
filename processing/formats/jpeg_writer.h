#pragma once

#include <cstddef>
#include <opencv2/core.hpp>
#include <vector>

namespace darkbox {

// JPEG bytes of R, G, B. Quality 1...100. Each throws InputError for an empty picture and beyond 65500 pixels a side.

/// For looking at: chroma at half the resolution.
std::vector<std::byte> encode_jpeg(const cv::Mat3b& image, int quality);
/// For pictures whose channels are data and not colours: full-resolution chroma.
std::vector<std::byte> encode_data_jpeg(const cv::Mat3b& image, int quality);

}  // namespace darkbox
