#pragma once

#include <filesystem>
#include <opencv2/core.hpp>
#include <optional>

#include "processing/maps/maps.h"
#include "processing/maps/view.h"
#include "processing/normals/integrate.h"

namespace darkbox {

struct MeshCounts {
    std::size_t vertices = 0;
    std::size_t faces = 0;
};

/// Binary little-endian mesh of a surface seen from the camera: a vertex with normal and colour for every valid pixel,
/// two triangles, counter-clockwise as the camera sees them, for every square of four pixels that no depth edge
/// crosses. Viewer frame (x right, y up, z to the camera): millimetres through view.point_at() where a view is given,
/// else pixels about the picture's centre; the file's comment says which. Written row by row: memory holds a few rows
/// and a number for each pixel. Throws InputError for an empty surface, maps that differ in size, or a file that
/// cannot be written.
MeshCounts write_ply(const std::filesystem::path& path, const HeightMap& surface, const NormalMap& normals,
                     const AlbedoMap& albedo, const std::optional<ViewGeometry>& view = {});

}  // namespace darkbox
