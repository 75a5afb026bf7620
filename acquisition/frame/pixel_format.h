#pragma once

#include <optional>
#include <string_view>

namespace darkbox {

/// How a sensor's samples lie in a Frame's bytes. Samples above 8 bits are little-endian 16-bit words, right-aligned.
/// The 16-bit forms have 9 to 16 significant bits.
enum class PixelFormat {
    grey8,
    grey16,
    rgb8,   ///< interleaved R, G, B
    rgb16,  ///< interleaved R, G, B
    rggb8,  ///< one sample a pixel behind a colour mosaic, named by its first two rows of two: R G over G B
    grbg8,
    gbrg8,
    bggr8,
    rggb16,
    grbg16,
    gbrg16,
    bggr16,
    mjpg,  ///< a JPEG of the camera's; its samples are R, G, B words of linear light, see motion_jpeg.h
    ycc8,  ///< luma and one chroma sample a pixel: Y Cb at even columns, Y Cr at odd ones (4:2:2); even widths only
};

/// Where the colours of a mosaic's red and blue samples lie: the parities of red's row and column; blue has the others.
struct Mosaic {
    int red_row = 0;
    int red_column = 0;
    friend bool operator==(const Mosaic&, const Mosaic&) = default;
};

int channels(PixelFormat format);
int bytes_per_sample(PixelFormat format);
/// No value for a format that has every colour at every pixel.
std::optional<Mosaic> mosaic(PixelFormat format);

/// The name used in session.json ("grey16", ...), and back; no value for a name that is not one.
std::string_view name(PixelFormat format);
std::optional<PixelFormat> pixel_format_from_name(std::string_view name);

}  // namespace darkbox
