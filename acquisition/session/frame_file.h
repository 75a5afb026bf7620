#pragma once

#include <cstddef>
#include <filesystem>
#include <vector>

#include "acquisition/frame/frame.h"
#include "acquisition/session/session.h"

namespace darkbox {

/// A range of a picture's rows, from the top.
struct RowBand {
    int first = 0;
    int count = 0;
};

/// What a session keeps of a frame: the camera's own JPEG where it gave one, else encode_frame_tiff().
std::vector<std::byte> encode_frame(const Frame& frame);
/// "tif", or "jpg" of frames of format mjpg.
constexpr const char* frame_extension(PixelFormat format) { return format == PixelFormat::mjpg ? "jpg" : "tif"; }

/// The frame as the bytes of an uncompressed TIFF: 8 or 16 bits a sample, little-endian, in strips of a few rows.
/// Samples stay as they are (right-aligned); MaxSampleValue says how many bits count.
/// Throws InputError when sizes and bytes of the frame do not agree.
std::vector<std::byte> encode_frame_tiff(const Frame& frame);

/// Reads a captured frame back bit for bit. `record` says what the file must hold; what it knows of sequence, time and
/// controls is put into the Frame (its exposure interval is not kept and stays empty).
/// Throws InputError that names the file when it is damaged, when it does not fit the record, or when the record's
/// format is not a PixelFormat: imported pictures ("png", "jpeg", ...) are decoded elsewhere.
Frame read_frame(const std::filesystem::path& file, const FrameRecord& record);

/// The same for some rows only: the Frame's height is band.count. Reads no more of the file than those rows; a
/// JPEG is read whole, and decoded down to them.
Frame read_frame_rows(const std::filesystem::path& file, const FrameRecord& record, RowBand band);

}  // namespace darkbox
