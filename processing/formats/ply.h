#pragma once

#include <filesystem>
#include <opencv2/core.hpp>
#include <optional>

#include "processing/maps/maps.h"

namespace darkbox {

/// Binary little-endian mesh of the height field: a vertex for every valid pixel (x right, y up, z to the camera) with
/// its normal and colour, two triangles where four neighbours are valid. Units are millimetres where the scale is
/// known, pixels otherwise; the file's comment says which. Throws InputError for an empty mask.
void write_ply(const std::filesystem::path& path, const cv::Mat1f& height_px, const NormalMap& normals,
               const AlbedoMap& albedo, std::optional<double> mm_per_pixel = {});

}  // namespace darkbox
