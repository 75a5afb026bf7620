#pragma once

#include <filesystem>
#include <opencv2/core.hpp>
#include <vector>

#include "processing/formats/exr.h"

namespace darkbox {

/// Any map as its file has it, for carrying it over pixel by pixel: nothing is decoded, scaled or averaged, so labels
/// and encoded normals stay what they are.
struct MapPicture {
    cv::Mat samples;                   ///< of a PNG: 8 or 16 bits, 1 or 3 channels; empty for an EXR
    std::vector<ExrChannel> channels;  ///< of an EXR: every one, by name, as 32-bit float

    cv::Size size() const { return samples.empty() ? channels.front().values.size() : samples.size(); }

    /// The map's value at each of the coordinates (x, y), which must lie inside it; 0 where they are negative.
    MapPicture read_through(const cv::Mat2i& coordinates) const;
};

/// PNG of 8 or 16 bits (without its alpha) or EXR, told by the extension. Throws InputError that names the file.
MapPicture read_map_picture(const std::filesystem::path& path);
/// In the format of its own, which the extension must name.
void write_map_picture(const std::filesystem::path& path, const MapPicture& map);

}  // namespace darkbox
