#pragma once

#include <cstddef>
#include <opencv2/core.hpp>
#include <vector>

namespace darkbox {

/// JPEG bytes of R, G, B with full-resolution chroma, for pictures whose channels are data and not colours. OpenCV's
/// writer halves the chroma. Throws InputError beyond 65500 pixels a side.
std::vector<std::byte> encode_data_jpeg(const cv::Mat3b& image, int quality);

}  // namespace darkbox
