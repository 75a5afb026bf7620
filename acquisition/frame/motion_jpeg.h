#pragma once

#include <cstddef>
#include <span>
#include <vector>

namespace darkbox {

/// Rows of a camera's JPEG as light: R, G, B words of 16 bits, 65535 = full scale, the curve of sRGB undone, by which
/// V4L2 says that JPEGs are coded. Standard Huffman tables may be missing, as they are from MJPG streams. `rows` from
/// row `first` on. Throws InputError for a JPEG that is damaged, cut short, or not of this size.
std::vector<std::byte> decode_motion_jpeg(std::span<const std::byte> jpeg, int width, int height, int first, int rows);

}  // namespace darkbox
