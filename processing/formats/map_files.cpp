#include "processing/formats/map_files.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "acquisition/frame/error.h"
#include "processing/formats/exr.h"
#include "processing/formats/picture.h"
#include "processing/formats/png.h"
#include "processing/maps/srgb.h"

namespace darkbox {
namespace {

namespace fs = std::filesystem;

constexpr float full = 65535.0F;
constexpr float length_tolerance = 0.25F;  // 8-bit maps and filtered ones are not of unit length

bool is_exr(const fs::path& path) { return picture_format_of(path) == PictureFormat::exr; }

ushort encoded(float component) { return cv::saturate_cast<ushort>((component + 1.0F) / 2.0F * full); }

cv::Vec3w encoded(const cv::Vec3f& normal) { return {encoded(normal[0]), encoded(normal[1]), encoded(normal[2])}; }

/// Components in -1...1, whatever the file's kind.
cv::Mat3f components_of(const fs::path& path) {
    const Picture picture = read_picture(path);
    if (picture.is_float) return picture.samples;
    cv::Mat3f components;
    picture.samples.convertTo(components, CV_32F, 2.0, -1.0);
    return components;
}

/// R, G, B; zeros where the map is not valid.
void write_inside(const fs::path& path, const cv::Mat3f& image, const cv::Mat1b& valid) {
    write_exr_rows(path, image.size(), {"R", "G", "B"}, [&](int row, float* samples) {
        for (int x = 0; x < image.cols; ++x, samples += 3)
            for (int c = 0; c < 3; ++c) samples[c] = valid(row, x) ? image(row, x)[c] : 0.0F;
    });
}

cv::Mat1b above_zero(const cv::Mat3f& image) {
    cv::Mat1b valid(image.size(), uchar{0});
    for (int y = 0; y < image.rows; ++y)
        for (int x = 0; x < image.cols; ++x)
            if (std::max({image(y, x)[0], image(y, x)[1], image(y, x)[2]}) > 0) valid(y, x) = 255;
    return valid;
}

void require_same_size(const fs::path& path, cv::Size size, cv::Size mask) {
    if (size != mask)
        throw InputError(fmt::format("{} is {}x{} pixels but its mask is {}x{}", path.string(), size.width, size.height,
                                     mask.width, mask.height),
                         "give a map and a mask of one size");
}

cv::Mat require_16_bit(const fs::path& path, int channels) {
    cv::Mat image = read_png(path);
    if (image.depth() != CV_16U || image.channels() != channels)
        throw InputError(
            fmt::format("{} is not a 16-bit PNG with {} channel{}", path.string(), channels, channels > 1 ? "s" : ""),
            "give a file that darkbox wrote");
    return image;
}

}  // namespace

void write_normal_map(const fs::path& path, const NormalMap& normals) {
    if (is_exr(path)) return write_inside(path, normals.normal, normals.valid);
    write_png_rows(path, normals.normal.size(), CV_16UC3, [&](int row, uchar* samples) {
        auto* pixels = reinterpret_cast<cv::Vec3w*>(samples);
        for (int x = 0; x < normals.normal.cols; ++x)
            pixels[x] = normals.valid(row, x) ? encoded(normals.normal(row, x)) : cv::Vec3w(0, 0, 0);
    });
}

NormalMap read_normal_map(const fs::path& path) { return read_normal_map(path, cv::Mat1b()); }

NormalMap read_normal_map(const fs::path& path, const cv::Mat1b& mask) {
    NormalMap map{components_of(path), {}};
    if (!mask.empty()) require_same_size(path, map.normal.size(), mask.size());
    map.valid = cv::Mat1b(map.normal.size(), uchar{0});
    for (int y = 0; y < map.normal.rows; ++y)
        for (int x = 0; x < map.normal.cols; ++x) {
            cv::Vec3f& n = map.normal(y, x);
            const auto length = static_cast<float>(cv::norm(n));
            const bool valid = std::abs(length - 1.0F) < length_tolerance && (mask.empty() || mask(y, x));
            n = valid ? n / length : cv::Vec3f(0, 0, 0);
            map.valid(y, x) = valid ? 255 : 0;
        }
    if (cv::countNonZero(map.valid) == 0)
        throw InputError(fmt::format("{} holds no normals", path.string()),
                         "a normal map has red = x, green = y (up), blue = z, each as (n + 1) / 2");
    return map;
}

void write_albedo_map(const fs::path& path, const AlbedoMap& albedo, double gain) {
    if (is_exr(path)) return write_inside(path, albedo.albedo, albedo.valid);
    write_png_rows(path, albedo.albedo.size(), CV_8UC3, [&](int row, uchar* samples) {
        cv::Mat3b pixels(1, albedo.albedo.cols, reinterpret_cast<cv::Vec3b*>(samples));
        viewable(albedo.albedo.row(row), gain).copyTo(pixels);
        pixels.setTo(cv::Vec3b(0, 0, 0), albedo.valid.row(row) == 0);
    });
}

AlbedoMap read_albedo_map(const fs::path& path, const cv::Mat1b& mask) {
    const Picture picture = read_picture(path);
    const bool linear = picture.embedded ? *picture.embedded == EmbeddedCurve::linear : picture.bit_depth > 8;
    AlbedoMap map{linear ? picture.samples : linear_from_srgb(picture.samples), mask};
    if (mask.empty())
        map.valid = above_zero(map.albedo);
    else
        require_same_size(path, map.albedo.size(), mask.size());
    return map;
}

void write_index_map(const fs::path& path, const IndexMap& index) {
    if (index.texels > 65535)
        throw InputError(fmt::format("{} texels do not fit a 16-bit index map", index.texels),
                         "ask for fewer clusters");
    write_png(path, index.label);
}

IndexMap read_index_map(const fs::path& path) {
    IndexMap index{require_16_bit(path, 1), 0};
    double most = 0;
    cv::minMaxLoc(index.label, nullptr, &most);
    index.texels = static_cast<int>(most);
    return index;
}

void write_coordinates(const fs::path& path, const cv::Mat2i& coordinates) {
    cv::Mat3w image(coordinates.size(), cv::Vec3w(0, 0, 0));
    for (int y = 0; y < image.rows; ++y)
        for (int x = 0; x < image.cols; ++x) {
            const cv::Vec2i& from = coordinates(y, x);
            if (from[0] >= 0) image(y, x) = {static_cast<ushort>(from[0]), static_cast<ushort>(from[1]), ushort{65535}};
        }
    write_png(path, image);
}

cv::Mat2i read_coordinates(const fs::path& path) {
    const cv::Mat3w image = require_16_bit(path, 3);
    cv::Mat2i coordinates(image.size(), cv::Vec2i(-1, -1));
    for (int y = 0; y < image.rows; ++y)
        for (int x = 0; x < image.cols; ++x)
            if (image(y, x)[2]) coordinates(y, x) = {image(y, x)[0], image(y, x)[1]};
    return coordinates;
}

}  // namespace darkbox
