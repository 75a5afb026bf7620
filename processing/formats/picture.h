#pragma once

#include <cstddef>
#include <filesystem>
#include <opencv2/core.hpp>
#include <optional>
#include <span>
#include <string>
#include <string_view>

namespace darkbox {

enum class PictureFormat { png, tiff, jpeg, exr };

/// The name used in session.json ("png", "tiff", "jpeg", "exr").
std::string_view name(PictureFormat format);

/// By the file's extension, any case: is it worth a look? No value for other files.
std::optional<PictureFormat> picture_format_of(const std::filesystem::path& path);

/// What an embedded profile says of the samples.
enum class EmbeddedCurve {
    linear,
    srgb,  ///< sRGB, or any other curve made for looking at
};

/// A picture as its file stores it, before any transfer curve. Channels in R, G, B order; grey is replicated; alpha is
/// left out; no rotation is applied, whatever EXIF says.
struct Picture {
    cv::Mat3f samples;  ///< integers as 0...1 (1 = full scale); floats as stored
    PictureFormat format = PictureFormat::png;
    int bit_depth = 8;  ///< 8, 16; 32 for float
    bool is_float = false;
    std::optional<EmbeddedCurve> embedded;  ///< none: the file says nothing
};

/// 255 where any channel is at full scale. Float pictures have no full scale and come out empty of it.
cv::Mat1b clipped_samples(const Picture& picture);

/// Reads 8- and 16-bit PNG, TIFF and JPEG, float TIFF, half and float EXR; the format is told by the content. Throws
/// InputError that names the file: missing, empty, not a picture, cut short, damaged, beyond 512 megapixels, or with
/// samples that are not finite.
Picture read_picture(const std::filesystem::path& path);

/// 255 where the picture's channel mean is at least half of full scale; anti-aliased edges are cut there. Throws
/// InputError for a picture that is black everywhere.
cv::Mat1b read_mask(const std::filesystem::path& path);

}  // namespace darkbox
