#pragma once

#include <filesystem>
#include <opencv2/core.hpp>

#include "processing/maps/maps.h"

namespace darkbox {

// Every writer is atomic; every reader throws InputError that names the file.

/// EXR: R, G, B = x, y, z. PNG (16 bit): round((n + 1) / 2 * 65535), red = x, green = +y (up), blue = z; pixels that
/// are not valid are (0, 0, 0) in both. The extension decides. Viewer frame.
void write_normal_map(const std::filesystem::path& path, const NormalMap& normals);
/// EXR, or PNG of 8 or 16 bits. Valid where the vector's length is near 1, and inside `mask` where one is given;
/// vectors are made unit length. Throws InputError when no pixel is valid.
NormalMap read_normal_map(const std::filesystem::path& path);
NormalMap read_normal_map(const std::filesystem::path& path, const cv::Mat1b& mask);

/// EXR: linear R, G, B; (0, 0, 0) where not valid. PNG: 8-bit sRGB for looking at, times `gain`.
void write_albedo_map(const std::filesystem::path& path, const AlbedoMap& albedo, double gain = 1.0);
/// From EXR as stored; from an integer picture through its embedded curve, else sRGB for 8 bits and linear for 16.
/// `mask` as valid pixels where it is not empty, else those above zero.
AlbedoMap read_albedo_map(const std::filesystem::path& path, const cv::Mat1b& mask = {});

/// 16-bit grey PNG; 0 = outside. Throws InputError beyond 65535 texels.
void write_index_map(const std::filesystem::path& path, const IndexMap& index);
/// The number of texels is the greatest label found.
IndexMap read_index_map(const std::filesystem::path& path);

/// 16-bit RGB PNG: red = source x, green = source y, blue = 65535 where valid.
void write_coordinates(const std::filesystem::path& path, const cv::Mat2i& coordinates);
cv::Mat2i read_coordinates(const std::filesystem::path& path);

/// Radiance as an EXR of `levels` columns and one row per texel, sample counts and mean albedo beside it in JSON.
void write_shading_maps(const std::filesystem::path& exr, const std::filesystem::path& json, const ShadingMaps& maps);
ShadingMaps read_shading_maps(const std::filesystem::path& exr, const std::filesystem::path& json);

/// True normals: the key Normal_gt of a MATLAB v5 file, as DiLiGenT gives it (rows x cols x 3,
/// viewer frame).
NormalMap read_normal_truth(const std::filesystem::path& mat_file);

}  // namespace darkbox
