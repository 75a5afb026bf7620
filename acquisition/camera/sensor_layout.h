#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "acquisition/frame/pixel_format.h"

namespace darkbox {

/// How the samples of one row follow each other in a driver's buffer.
enum class Packing {
    bytes,      ///< one byte each
    words,      ///< 16-bit little-endian words, right-aligned
    mipi10,     ///< five bytes for four samples: their upper eight bits, then the lower two, sample 0 in bits 0 and 1
    mipi12,     ///< three bytes for two samples: their upper eight bits, then the lower four, sample 0 in bits 0 to 3
    bits10,     ///< ten bits each with no gap between them, the most significant first
    jpeg,       ///< a JPEG, as long as it comes out
    luma_last,  ///< NV12: a plane of luma, then one of Cb, Cr pairs for two by two pixels
};

/// One of V4L2's pixel formats and what becomes of it. Source: the kernel's "Image Formats" (userspace-api/media/v4l).
struct SensorFormat {
    std::uint32_t fourcc = 0;
    PixelFormat format = PixelFormat::grey8;
    int bit_depth = 8;
    Packing packing = Packing::bytes;
    double black_level = 0.0;  ///< sample units; by the format's definition
};

/// Those that darkbox can keep, the best to measure with first: what is nearest to the sensor, then the deepest.
std::span<const SensorFormat> sensor_formats();
std::optional<SensorFormat> sensor_format(std::uint32_t fourcc);

/// "Y16 ", "pRAA": a code as people write it, and back ("Y16" is "Y16 "). No value for what is not one to four
/// printable characters.
std::string fourcc_name(std::uint32_t fourcc);
std::optional<std::uint32_t> fourcc_from_name(std::string_view name);

/// A picture's place in a driver's buffer.
struct SensorLayout {
    SensorFormat format;
    int width = 0;
    int height = 0;
    std::size_t bytes_per_line = 0;  ///< of a luma row where there are two planes; rows may be padded
};

/// Bytes of one row without padding.
std::size_t row_bytes(const SensorFormat& format, int width);

/// Bytes from the buffer's begin to the last sample; the last row needs no padding. Of a JPEG the fewest that may be
/// one.
std::size_t payload_bytes(const SensorLayout& layout);

/// The samples as a Frame keeps them, without loss: NV12's rows of chroma are repeated, nothing is interpolated.
/// Throws InputError for a payload shorter than payload_bytes(), an odd width of a format with shared chroma, or rows
/// longer than bytes_per_line.
std::vector<std::byte> unpack(const SensorLayout& layout, std::span<const std::byte> payload);

}  // namespace darkbox
