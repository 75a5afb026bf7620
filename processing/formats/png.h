#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <opencv2/core.hpp>
#include <vector>

namespace darkbox {

/// PNG bytes of a 1- or 3-channel picture of 8 or 16 bits; three channels are R, G, B.
std::vector<std::byte> encode_png(const cv::Mat& image);

void write_png(const std::filesystem::path& path, const cv::Mat& image);

/// Puts one row's samples in place: width times channels of them, 8 or 16 bits each.
using FillPngRow = std::function<void(int row, uchar* samples)>;
/// For pictures that need not be in memory as they are written. `type` is OpenCV's: CV_8UC1, CV_8UC3, CV_16UC1 or
/// CV_16UC3.
void write_png_rows(const std::filesystem::path& path, cv::Size size, int type, const FillPngRow& fill);

/// Samples as stored, unscaled: CV_8U or CV_16U with 1 or 3 channels (R, G, B; alpha left out). Throws InputError as
/// read_picture() does.
cv::Mat read_png(const std::filesystem::path& path);

}  // namespace darkbox
