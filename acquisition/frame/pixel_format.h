#pragma once

#include <optional>
#include <string_view>

namespace darkbox {

/// How a sensor's samples lie in a Frame's bytes. Samples above 8 bits are little-endian 16-bit words, right-aligned.
enum class PixelFormat {
    grey8,
    grey16,  ///< 9 to 16 significant bits
    rgb8,    ///< interleaved R, G, B
    rgb16,   ///< interleaved R, G, B, 9 to 16 significant bits
};

int channels(PixelFormat format);
int bytes_per_sample(PixelFormat format);

/// The name used in session.json ("grey16", ...), and back; no value for a name that is not one.
std::string_view name(PixelFormat format);
std::optional<PixelFormat> pixel_format_from_name(std::string_view name);

}  // namespace darkbox
