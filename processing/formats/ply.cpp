#include "processing/formats/ply.h"

#include <fmt/format.h>

#include <array>
#include <bit>
#include <cstring>
#include <string>

#include "acquisition/frame/error.h"
#include "processing/formats/atomic_file.h"
#include "processing/formats/srgb.h"

namespace darkbox {
namespace {

static_assert(std::endian::native == std::endian::little, "the mesh is written as little-endian words");

template <class Value>
void append(std::string& out, const Value& value) {
    out.append(reinterpret_cast<const char*>(&value), sizeof value);
}

/// Vertex numbers by pixel, -1 where there is none.
struct Numbering {
    cv::Mat1i number;
    int count = 0;
};

Numbering number_vertices(const cv::Mat1b& valid) {
    Numbering numbering{cv::Mat1i(valid.size(), -1), 0};
    for (int y = 0; y < valid.rows; ++y)
        for (int x = 0; x < valid.cols; ++x)
            if (valid(y, x)) numbering.number(y, x) = numbering.count++;
    return numbering;
}

/// Two triangles for every square of four valid pixels, counter-clockwise as the camera sees them.
struct Faces {
    std::string bytes;
    int count = 0;
};

Faces faces_of(const cv::Mat1i& number) {
    Faces faces;
    const auto face = [&](int a, int b, int c) {
        append(faces.bytes, std::uint8_t{3});
        for (const int index : {a, b, c}) append(faces.bytes, std::int32_t{index});
        ++faces.count;
    };
    for (int y = 0; y + 1 < number.rows; ++y)
        for (int x = 0; x + 1 < number.cols; ++x) {
            const int a = number(y, x), b = number(y, x + 1), c = number(y + 1, x), d = number(y + 1, x + 1);
            if (a < 0 || b < 0 || c < 0 || d < 0) continue;
            face(a, c, b);
            face(b, c, d);
        }
    return faces;
}

std::string header(int vertices, int faces, std::optional<double> mm_per_pixel) {
    const std::string unit =
        mm_per_pixel ? fmt::format("millimetres ({:.6g} per pixel)", *mm_per_pixel) : std::string("pixels");
    return fmt::format(
        "ply\nformat binary_little_endian 1.0\ncomment darkbox surface; units: {}; x right, y up, z to the camera\n"
        "element vertex {}\nproperty float x\nproperty float y\nproperty float z\n"
        "property float nx\nproperty float ny\nproperty float nz\n"
        "property uchar red\nproperty uchar green\nproperty uchar blue\n"
        "element face {}\nproperty list uchar int vertex_indices\nend_header\n",
        unit, vertices, faces);
}

}  // namespace

void write_ply(const std::filesystem::path& path, const cv::Mat1f& height_px, const NormalMap& normals,
               const AlbedoMap& albedo, std::optional<double> mm_per_pixel) {
    const Numbering numbering = number_vertices(normals.valid);
    if (numbering.count == 0) throw InputError("the surface has no points", "check the mask");
    const auto scale = static_cast<float>(mm_per_pixel.value_or(1.0));
    const cv::Mat3b colours = viewable(albedo.albedo, viewing_gain(albedo.albedo, albedo.valid));
    const float centre_x = static_cast<float>(height_px.cols - 1) / 2.0F;
    const float centre_y = static_cast<float>(height_px.rows - 1) / 2.0F;
    std::string vertices;
    for (int y = 0; y < height_px.rows; ++y)
        for (int x = 0; x < height_px.cols; ++x) {
            if (!normals.valid(y, x)) continue;
            const cv::Vec3f point(static_cast<float>(x) - centre_x, centre_y - static_cast<float>(y), height_px(y, x));
            for (int i = 0; i < 3; ++i) append(vertices, point[i] * scale);
            for (int i = 0; i < 3; ++i) append(vertices, normals.normal(y, x)[i]);
            for (int i = 0; i < 3; ++i) append(vertices, colours(y, x)[i]);
        }
    const Faces faces = faces_of(numbering.number);
    write_file(path, header(numbering.count, faces.count, mm_per_pixel) + vertices + faces.bytes);
}

}  // namespace darkbox
