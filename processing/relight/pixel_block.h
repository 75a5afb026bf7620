#pragma once

#include <cstdint>

namespace darkbox {

constexpr int block_pixels = 64;

/// Up to 64 neighbours in a row, as the renderer takes them: planes, unit normals. A pixel that is not to be rendered
/// has texel 0, detail 0 and any normal of unit length.
struct alignas(64) PixelBlock {
    float normal[3][block_pixels];
    std::int32_t texel[block_pixels];
    float detail[3][block_pixels];  ///< own albedo over the texel's mean, R, G, B
};

/// The same in 14 bytes a pixel.
struct alignas(64) CompactBlock {
    std::int16_t normal[3][block_pixels];  ///< times 32767
    std::uint16_t texel[block_pixels];
    std::uint16_t detail[3][block_pixels];  ///< bits of a half float
};

}  // namespace darkbox
