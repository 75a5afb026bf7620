#include "processing/formats/picture.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <vector>

#include "processing/formats/atomic_file.h"
#include "processing/formats/exr_codec.h"
#include "processing/formats/picture_header.h"
#include "processing/formats/picture_rows.h"
#include "processing/maps/maps.h"

namespace darkbox {
namespace {

namespace fs = std::filesystem;

constexpr std::uint64_t most_pixels = 512'000'000;

bool begins_with(Bytes bytes, std::string_view magic) {
    return bytes.size() >= magic.size() &&
           std::equal(magic.begin(), magic.end(), reinterpret_cast<const char*>(bytes.data()));
}

std::optional<PictureFormat> format_by_content(Bytes bytes) {
    using namespace std::string_view_literals;
    if (begins_with(bytes, "\x89PNG\r\n\x1a\n")) return PictureFormat::png;
    if (begins_with(bytes, "\xFF\xD8\xFF")) return PictureFormat::jpeg;
    if (begins_with(bytes, "\x76\x2f\x31\x01")) return PictureFormat::exr;
    for (const auto magic : {"II*\0"sv, "MM\0*"sv, "II+\0"sv, "MM\0+"sv})
        if (begins_with(bytes, magic)) return PictureFormat::tiff;
    return std::nullopt;
}

PictureHeader inspect(Bytes bytes, PictureFormat format, const std::string& file) {
    switch (format) {
        case PictureFormat::png:
            return inspect_png(bytes, file);
        case PictureFormat::jpeg:
            return inspect_jpeg(bytes, file);
        default:
            return inspect_tiff(bytes, file);
    }
}

double full_scale(int depth) { return depth == CV_8U ? 255.0 : depth == CV_16U ? 65535.0 : 1.0; }

Picture decode_exr_picture(Bytes bytes, const std::string& file) {
    Picture picture;
    picture.samples = colour_of(decode_exr(bytes, file, most_pixels), file);
    picture.bit_depth = 32;
    picture.is_float = true;
    picture.embedded = EmbeddedCurve::linear;  // by definition of the format
    return picture;
}

/// The container is walked as a whole before, since decoders do not tell all of its damage.
std::optional<EmbeddedCurve> inspected_curve(Bytes bytes, PictureFormat format, const std::string& file) {
    const PictureHeader header = inspect(bytes, format, file);
    require_sane_size(header.width, header.height, file);
    return header.embedded;
}

Picture read_by_rows(const fs::path& path) {
    const std::unique_ptr<PictureRows> rows = open_picture_rows(path);
    cv::Mat samples(rows->size(), rows->type());
    rows->read(samples);
    Picture picture;
    samples.convertTo(picture.samples, CV_32F, 1.0 / full_scale(samples.depth()));
    picture.is_float = samples.depth() == CV_32F;
    picture.bit_depth = picture.is_float ? 32 : samples.depth() == CV_16U ? 16 : 8;
    return picture;
}

}  // namespace

PictureFormat require_picture_format(Bytes bytes, const std::string& file) {
    if (bytes.empty()) throw bad_picture(file, "is empty");
    if (const auto format = format_by_content(bytes)) return *format;
    throw InputError(fmt::format("{} is not a picture that darkbox reads", file), "give PNG, TIFF, JPEG or EXR");
}

void require_finite(const cv::Mat3f& samples, int first_row, const std::string& file) {
    for (int y = 0; y < samples.rows; ++y)
        for (int x = 0; x < samples.cols; ++x) {
            const cv::Vec3f& p = samples(y, x);
            if (!std::isfinite(p[0]) || !std::isfinite(p[1]) || !std::isfinite(p[2]))
                throw bad_picture(
                    file, fmt::format("has a sample that is not a finite number at ({}, {})", x, first_row + y));
        }
}

void require_sane_size(std::uint64_t width, std::uint64_t height, const std::string& file) {
    if (width == 0 || height == 0) throw bad_picture(file, "has no pixels");
    if (width > most_pixels || height > most_pixels || width * height > most_pixels)
        throw InputError(fmt::format("{} claims {}x{} pixels, more than the {} megapixels that darkbox reads", file,
                                     width, height, most_pixels / 1'000'000),
                         "check the file, or scale the picture down");
}

std::string_view name(PictureFormat format) {
    constexpr std::array<std::string_view, 4> names{"png", "tiff", "jpeg", "exr"};
    return names[static_cast<std::size_t>(format)];
}

std::optional<PictureFormat> picture_format_of(const fs::path& path) {
    std::string extension = path.extension().string();
    std::transform(extension.begin(), extension.end(), extension.begin(),
                   [](unsigned char c) { return std::tolower(c); });
    if (extension == ".png") return PictureFormat::png;
    if (extension == ".tif" || extension == ".tiff") return PictureFormat::tiff;
    if (extension == ".jpg" || extension == ".jpeg") return PictureFormat::jpeg;
    if (extension == ".exr") return PictureFormat::exr;
    return std::nullopt;
}

cv::Mat1b clipped_samples(const Picture& picture) {
    cv::Mat1b clipped(picture.samples.size(), uchar{0});
    if (picture.is_float) return clipped;
    for (int y = 0; y < clipped.rows; ++y)
        for (int x = 0; x < clipped.cols; ++x) {
            const cv::Vec3f& p = picture.samples(y, x);
            if (std::max({p[0], p[1], p[2]}) >= 1.0F) clipped(y, x) = 255;
        }
    return clipped;
}

Picture read_picture(const fs::path& path) {
    const std::string file = path.string();
    std::vector<std::byte> bytes = read_file(path);
    const PictureFormat format = require_picture_format(bytes, file);
    Picture picture;
    if (format == PictureFormat::exr) {
        picture = decode_exr_picture(bytes, file);
        require_finite(picture.samples, 0, file);
    } else {
        const std::optional<EmbeddedCurve> embedded = inspected_curve(bytes, format, file);
        bytes = {};
        picture = read_by_rows(path);
        picture.embedded = embedded;
    }
    picture.format = format;
    return picture;
}

cv::Mat1b read_mask(const fs::path& path) {
    const cv::Mat1f grey = mean_channel(read_picture(path).samples);
    cv::Mat1b mask;
    cv::compare(grey, 0.5, mask, cv::CMP_GE);
    if (cv::countNonZero(mask) == 0)
        throw InputError(fmt::format("the mask {} is black everywhere", path.string()),
                         "a mask is white where the object is");
    return mask;
}

}  // namespace darkbox
