#include "acquisition/frame/motion_jpeg.h"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <string>

#include "acquisition/frame/error.h"
#include "acquisition/frame/jpeg_decoder.h"

namespace darkbox {
namespace {

/// Any warning: libjpeg would make up what is missing.
void leave_on_warning(j_common_ptr common, int level) {
    if (level < 0) JpegDecoder::leave(common);
}

bool read_header(JpegDecoder& decoder, std::span<const std::byte> bytes) {
    if (setjmp(decoder.way_out) != 0) return false;
    ::jpeg_create_decompress(&decoder.decompress);
    ::jpeg_mem_src(&decoder.decompress, reinterpret_cast<const unsigned char*>(bytes.data()), bytes.size());
    ::jpeg_read_header(&decoder.decompress, TRUE);
    decoder.decompress.out_color_space = JCS_RGB;
    decoder.decompress.dct_method = JDCT_ISLOW;
    return true;
}

/// Also looks at what follows the last row: it must be a picture's end.
bool finish(JpegDecoder& decoder) {
    if (setjmp(decoder.way_out) != 0) return false;
    return ::jpeg_finish_decompress(&decoder.decompress) == TRUE;
}

/// IEC 61966-2-1.
std::array<std::uint16_t, 256> light_of_codes() {
    std::array<std::uint16_t, 256> light{};
    for (std::size_t code = 0; code < light.size(); ++code) {
        const double v = static_cast<double>(code) / 255;
        const double linear = v <= 0.04045 ? v / 12.92 : std::pow((v + 0.055) / 1.055, 2.4);
        light[code] = static_cast<std::uint16_t>(std::lround(65535 * linear));
    }
    return light;
}

[[noreturn]] void refuse_jpeg(const std::string& what) {
    throw InputError("a JPEG of the camera " + what, "check the camera's cable and the load on its bus");
}

}  // namespace

std::vector<std::byte> decode_motion_jpeg(std::span<const std::byte> jpeg, int width, int height, int first, int rows) {
    static const std::array<std::uint16_t, 256> light = light_of_codes();
    JpegDecoder decoder(leave_on_warning);
    if (!read_header(decoder, jpeg)) refuse_jpeg(std::string("is damaged: ") + decoder.error);
    const auto& header = decoder.decompress;
    if (static_cast<int>(header.image_width) != width || static_cast<int>(header.image_height) != height)
        refuse_jpeg(fmt::format("has {} x {} pixels instead of {} x {}", header.image_width, header.image_height, width,
                                height));
    const std::size_t samples = 3 * static_cast<std::size_t>(width);
    std::vector<std::byte> result(2 * samples * static_cast<std::size_t>(rows));
    std::vector<unsigned char> row(samples);
    std::vector<std::uint16_t> words(samples);
    bool good = decoder.start();
    for (int y = 0; good && y < first + rows; ++y) {
        good = decoder.read_row(row.data());
        if (y < first) continue;
        for (std::size_t i = 0; i < samples; ++i) words[i] = light[row[i]];
        std::memcpy(result.data() + 2 * samples * static_cast<std::size_t>(y - first), words.data(), 2 * samples);
    }
    if (good && first + rows == height) good = finish(decoder);
    if (!good) refuse_jpeg(std::string("is damaged or cut short: ") + decoder.error);
    return result;
}

}  // namespace darkbox
