#pragma once

#include <cmath>
#include <cstddef>
#include <cstdio>
#include <cstdlib>
#include <vector>

// jpeglib.h needs <cstdio> before it.
#include <jpeglib.h>

namespace darkbox::test {

/// A JPEG as a camera makes one: R, G, B bytes, chroma at full resolution.
inline std::vector<std::byte> jpeg_of(const std::vector<unsigned char>& rgb, int width, int height, int quality = 95) {
    jpeg_compress_struct codec{};
    jpeg_error_mgr errors{};
    codec.err = ::jpeg_std_error(&errors);
    ::jpeg_create_compress(&codec);
    unsigned char* bytes = nullptr;
    unsigned long size = 0;
    ::jpeg_mem_dest(&codec, &bytes, &size);
    codec.image_width = static_cast<JDIMENSION>(width);
    codec.image_height = static_cast<JDIMENSION>(height);
    codec.input_components = 3;
    codec.in_color_space = JCS_RGB;
    ::jpeg_set_defaults(&codec);
    ::jpeg_set_quality(&codec, quality, TRUE);
    for (int c = 0; c < 3; ++c) codec.comp_info[c].h_samp_factor = codec.comp_info[c].v_samp_factor = 1;
    ::jpeg_start_compress(&codec, TRUE);
    for (int y = 0; y < height; ++y) {
        auto* row = const_cast<unsigned char*>(rgb.data() + std::size_t{3} * y * width);  // libjpeg only reads it
        ::jpeg_write_scanlines(&codec, &row, 1);
    }
    ::jpeg_finish_compress(&codec);
    ::jpeg_destroy_compress(&codec);
    const auto* begin = reinterpret_cast<const std::byte*>(bytes);
    std::vector<std::byte> jpeg(begin, begin + size);
    std::free(bytes);
    return jpeg;
}

/// The same without its Huffman tables, as streams of MJPG often come.
inline std::vector<std::byte> without_tables(const std::vector<std::byte>& jpeg) {
    constexpr std::byte mark{0xff}, tables{0xc4}, scan{0xda};
    std::vector<std::byte> stripped(jpeg.begin(), jpeg.begin() + 2);
    std::size_t at = 2;
    while (at + 4 < jpeg.size() && jpeg[at] == mark && jpeg[at + 1] != scan) {
        const std::size_t length =
            2 + std::to_integer<std::size_t>(jpeg[at + 2]) * 256 + std::to_integer<std::size_t>(jpeg[at + 3]);
        if (jpeg[at + 1] != tables)
            stripped.insert(stripped.end(), jpeg.begin() + static_cast<std::ptrdiff_t>(at),
                            jpeg.begin() + static_cast<std::ptrdiff_t>(at + length));
        at += length;
    }
    stripped.insert(stripped.end(), jpeg.begin() + static_cast<std::ptrdiff_t>(at), jpeg.end());
    return stripped;
}

/// The code that sRGB gives this share of full scale.
inline unsigned char srgb_code(double light) {
    const double v = light <= 0.0031308 ? 12.92 * light : 1.055 * std::pow(light, 1 / 2.4) - 0.055;
    return static_cast<unsigned char>(std::lround(255 * std::fmin(1, std::fmax(0, v))));
}

}  // namespace darkbox::test
