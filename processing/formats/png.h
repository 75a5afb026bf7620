#pragma once

#include <cstddef>
#include <filesystem>
#include <opencv2/core.hpp>
#include <vector>

namespace darkbox {

/// PNG bytes of a 1- or 3-channel picture of 8 or 16 bits; three channels are R, G, B.
std::vector<std::byte> encode_png(const cv::Mat& image);
/// JPEG bytes, for pictures inside a report. Quality 1...100.
std::vector<std::byte> encode_jpeg(const cv::Mat3b& image, int quality);

void write_png(const std::filesystem::path& path, const cv::Mat& image);

/// Samples as stored, unscaled: CV_8U or CV_16U with 1 or 3 channels (R, G, B; alpha left out). Throws InputError as
/// read_picture() does.
cv::Mat read_png(const std::filesystem::path& path);

}  // namespace darkbox
