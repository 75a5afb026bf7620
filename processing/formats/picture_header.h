#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "processing/formats/bytes.h"
#include "processing/formats/picture.h"

namespace darkbox {

/// What a file says of itself before its samples are decoded.
struct PictureHeader {
    std::uint64_t width = 0;
    std::uint64_t height = 0;
    int bit_depth = 8;
    bool is_float = false;
    std::optional<EmbeddedCurve> embedded;
};

// Each walks the whole container, because decoders hand out half a picture from half a file without a word. Throws
// InputError when the file is cut short or damaged.

PictureHeader inspect_png(Bytes bytes, const std::string& file);   ///< every chunk's checksum, up to IEND
PictureHeader inspect_jpeg(Bytes bytes, const std::string& file);  ///< every segment and scan, up to EOI
PictureHeader inspect_tiff(Bytes bytes, const std::string& file);  ///< first directory, every strip or tile

/// Throws InputError for no pixels, or beyond 512 megapixels.
void require_sane_size(std::uint64_t width, std::uint64_t height, const std::string& file);

/// By its first bytes. Throws InputError when it is empty or none of the formats.
PictureFormat require_picture_format(Bytes bytes, const std::string& file);

/// Throws InputError that names the first sample that is not finite; `samples` begin at row `first_row`.
void require_finite(const cv::Mat3f& samples, int first_row, const std::string& file);

}  // namespace darkbox
