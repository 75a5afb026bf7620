#include "processing/formats/picture.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "processing/formats/atomic_file.h"
#include "processing/formats/exr_codec.h"
#include "processing/formats/picture_header.h"
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

cv::Mat decode_with_opencv(Bytes bytes, const std::string& file) {
    const cv::Mat buffer(1, static_cast<int>(bytes.size()), CV_8U, const_cast<std::byte*>(bytes.data()));
    cv::Mat decoded;
    try {
        decoded = cv::imdecode(buffer, cv::IMREAD_COLOR | cv::IMREAD_ANYDEPTH | cv::IMREAD_IGNORE_ORIENTATION);
    } catch (const cv::Exception&) {
        decoded.release();  // one error for both ways in which it fails
    }
    if (decoded.empty() || decoded.channels() != 3) throw bad_picture(file, "is damaged: it cannot be decoded");
    return decoded;
}

double full_scale(int depth, const std::string& file) {
    if (depth == CV_8U) return 255.0;
    if (depth == CV_16U) return 65535.0;
    if (depth == CV_32F) return 1.0;
    throw InputError(fmt::format("{} has a kind of samples that darkbox does not read", file),
                     "save it with 8 or 16 bits, or as 32-bit float");
}

Picture decode_exr_picture(Bytes bytes, const std::string& file) {
    Picture picture;
    picture.samples = colour_of(decode_exr(bytes, file, most_pixels), file);
    picture.bit_depth = 32;
    picture.is_float = true;
    picture.embedded = EmbeddedCurve::linear;  // by definition of the format
    return picture;
}

Picture decode_integer_picture(Bytes bytes, PictureFormat format, const std::string& file) {
    const PictureHeader header = inspect(bytes, format, file);
    require_sane_size(header.width, header.height, file);
    const cv::Mat bgr = decode_with_opencv(bytes, file);
    Picture picture;
    bgr.convertTo(picture.samples, CV_32F, 1.0 / full_scale(bgr.depth(), file));
    cv::cvtColor(picture.samples, picture.samples, cv::COLOR_BGR2RGB);
    picture.is_float = bgr.depth() == CV_32F;
    picture.bit_depth = picture.is_float ? 32 : bgr.depth() == CV_16U ? 16 : 8;
    picture.embedded = header.embedded;
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

Picture decode_picture(Bytes bytes, const std::string& file) {
    const PictureFormat format = require_picture_format(bytes, file);
    Picture picture =
        format == PictureFormat::exr ? decode_exr_picture(bytes, file) : decode_integer_picture(bytes, format, file);
    picture.format = format;
    if (picture.is_float) require_finite(picture.samples, 0, file);
    return picture;
}

Picture read_picture(const fs::path& path) { return decode_picture(read_file(path), path.string()); }

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
