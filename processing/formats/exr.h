#pragma once

#include <filesystem>
#include <functional>
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

/// Writes 32-bit float without loss. Run lengths make little of what is outside an object and cost next to nothing;
/// what is on it is noise to any codec. Throws InputError when the channels differ in size or are empty.
void write_exr(const std::filesystem::path& path, const std::vector<ExrChannel>& channels);
/// Channels R, G, B.
void write_exr(const std::filesystem::path& path, const cv::Mat3f& image);
/// Channel Y.
void write_exr(const std::filesystem::path& path, const cv::Mat1f& image);

/// Puts one row's samples in place, the channels of one pixel after the other.
using FillExrRow = std::function<void(int row, float* samples)>;
/// For pictures that need not be in memory as they are written.
void write_exr_rows(const std::filesystem::path& path, cv::Size size, const std::vector<std::string>& channels,
                    const FillExrRow& fill);

/// One channel by name, as float. Throws InputError when the file is damaged or has no such channel.
cv::Mat1f read_exr_channel(const std::filesystem::path& path, const std::string& channel);
/// The same; no value when there is no such channel.
std::optional<cv::Mat1f> find_exr_channel(const std::filesystem::path& path, const std::string& channel);
/// Every channel by name, at least one.
std::vector<ExrChannel> read_exr_channels(const std::filesystem::path& path);
/// R, G, B, or Y replicated; values as stored, not checked for NaN.
cv::Mat3f read_exr_colour(const std::filesystem::path& path);

}  // namespace darkbox
