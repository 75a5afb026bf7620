#pragma once

#include <filesystem>
#include <opencv2/core.hpp>
#include <optional>
#include <string>
#include <vector>

namespace darkbox {

/// One named channel of an EXR file.
struct ExrChannel {
    std::string name;
    cv::Mat1f values;
};

/// Writes 32-bit float, ZIP-compressed, without loss. Throws InputError when the channels differ in size or are empty.
void write_exr(const std::filesystem::path& path, const std::vector<ExrChannel>& channels);
/// Channels R, G, B.
void write_exr(const std::filesystem::path& path, const cv::Mat3f& image);
/// Channel Y.
void write_exr(const std::filesystem::path& path, const cv::Mat1f& image);

/// One channel by name, as float. Throws InputError when the file is damaged or has no such channel.
cv::Mat1f read_exr_channel(const std::filesystem::path& path, const std::string& channel);
/// The same; no value when there is no such channel.
std::optional<cv::Mat1f> find_exr_channel(const std::filesystem::path& path, const std::string& channel);
/// R, G, B, or Y replicated; values as stored, not checked for NaN.
cv::Mat3f read_exr_colour(const std::filesystem::path& path);

}  // namespace darkbox
