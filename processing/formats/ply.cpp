#include "processing/formats/ply.h"

#include <fmt/format.h>

#include <bit>
#include <string>

#include "acquisition/frame/error.h"
#include "processing/formats/atomic_file.h"
#include "processing/maps/require.h"
#include "processing/maps/srgb.h"

namespace darkbox {
namespace {

static_assert(std::endian::native == std::endian::little, "the mesh is written as little-endian words");

template <class Value>
void append(std::string& out, const Value& value) {
    out.append(reinterpret_cast<const char*>(&value), sizeof value);
}

/// Vertex numbers by pixel, in raster order, -1 where there is none.
cv::Mat1i number_vertices(const cv::Mat1b& valid) {
    cv::Mat1i number(valid.size(), -1);
    int count = 0;
    for (int y = 0; y < valid.rows; ++y)
        for (int x = 0; x < valid.cols; ++x)
            if (valid(y, x)) number(y, x) = count++;
    return number;
}

/// Whether the square with its upper left corner at (x, y) is part of the surface.
bool is_square(const HeightMap& surface, int x, int y) {
    if (!surface.valid(y, x) || !surface.valid(y, x + 1) || !surface.valid(y + 1, x) || !surface.valid(y + 1, x + 1))
        return false;
    const unsigned crossing = (surface.cut(y, x) & (cut_right | cut_down)) | (surface.cut(y, x + 1) & cut_down) |
                              (surface.cut(y + 1, x) & cut_right);
    return crossing == 0;
}

MeshCounts counts_of(const HeightMap& surface) {
    MeshCounts counts;
    counts.vertices = static_cast<std::size_t>(cv::countNonZero(surface.valid));
    for (int y = 0; y + 1 < surface.valid.rows; ++y)
        for (int x = 0; x + 1 < surface.valid.cols; ++x)
            if (is_square(surface, x, y)) counts.faces += 2;
    return counts;
}

std::string header(const MeshCounts& counts, const std::optional<ViewGeometry>& view) {
    const std::string unit =
        view ? fmt::format("millimetres ({:.6g} per pixel at z = 0)", view->mm_per_pixel) : "pixels";
    return fmt::format(
        "ply\nformat binary_little_endian 1.0\ncomment darkbox surface; units: {}; x right, y up, z to the camera\n"
        "element vertex {}\nproperty float x\nproperty float y\nproperty float z\n"
        "property float nx\nproperty float ny\nproperty float nz\n"
        "property uchar red\nproperty uchar green\nproperty uchar blue\n"
        "element face {}\nproperty list uchar int vertex_indices\nend_header\n",
        unit, counts.vertices, counts.faces);
}

/// Without a view, pixels count from the picture's centre.
ViewGeometry pixels_about_centre(cv::Size size) {
    ViewGeometry view;
    view.principal = {(size.width - 1) / 2.0, (size.height - 1) / 2.0};
    return view;
}

std::string vertex_row(const HeightMap& surface, const NormalMap& normals, const cv::Mat3b& colours,
                       const ViewGeometry& view, int y) {
    std::string bytes;
    for (int x = 0; x < surface.valid.cols; ++x) {
        if (!surface.valid(y, x)) continue;
        const Eigen::Vector3f point = view.point_at(cv::Point2d(x, y), surface.height(y, x)).cast<float>();
        for (int i = 0; i < 3; ++i) append(bytes, point[i]);
        for (int i = 0; i < 3; ++i) append(bytes, normals.normal(y, x)[i]);
        for (int i = 0; i < 3; ++i) append(bytes, colours(0, x)[i]);
    }
    return bytes;
}

std::string face_row(const HeightMap& surface, const cv::Mat1i& number, int y) {
    std::string bytes;
    const auto face = [&](int a, int b, int c) {
        append(bytes, std::uint8_t{3});
        for (const int index : {a, b, c}) append(bytes, std::int32_t{index});
    };
    for (int x = 0; x + 1 < number.cols; ++x) {
        if (!is_square(surface, x, y)) continue;
        const int a = number(y, x), b = number(y, x + 1), c = number(y + 1, x), d = number(y + 1, x + 1);
        face(a, c, b);
        face(b, c, d);
    }
    return bytes;
}

}  // namespace

MeshCounts write_ply(const std::filesystem::path& path, const HeightMap& surface, const NormalMap& normals,
                     const AlbedoMap& albedo, const std::optional<ViewGeometry>& view) {
    require_size("the normal map", normals.normal.size(), surface.valid.size());
    require_size("the albedo map", albedo.albedo.size(), surface.valid.size());
    const MeshCounts counts = counts_of(surface);
    if (counts.vertices == 0) throw InputError("the surface has no points", "check the mask");
    const double gain = viewing_gain(albedo.albedo, albedo.valid);
    const ViewGeometry geometry = view.value_or(pixels_about_centre(surface.valid.size()));
    AtomicFile file(path);
    file.write(header(counts, view));
    for (int y = 0; y < surface.valid.rows; ++y)
        file.write(vertex_row(surface, normals, viewable(albedo.albedo.row(y), gain), geometry, y));
    const cv::Mat1i number = number_vertices(surface.valid);
    for (int y = 0; y + 1 < surface.valid.rows; ++y) file.write(face_row(surface, number, y));
    file.commit();
    return counts;
}

}  // namespace darkbox
