#include "acquisition/frame/motion_jpeg.h"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <csetjmp>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <string>

#include "acquisition/frame/error.h"

// jpeglib.h needs <cstdio> before it.
#include <jpeglib.h>

namespace darkbox {
namespace {

/// libjpeg leaves its functions by longjmp: what calls them here holds nothing that needs a destructor.
struct MotionDecoder {
    MotionDecoder() {
        jpeg.err = ::jpeg_std_error(&errors);
        jpeg.client_data = this;
        errors.error_exit = leave;
        errors.emit_message = [](j_common_ptr common, int level) {
            if (level < 0) leave(common);  // a warning: libjpeg would make up what is missing
        };
        errors.output_message = [](j_common_ptr) {};
    }
    MotionDecoder(const MotionDecoder&) = delete;
    MotionDecoder& operator=(const MotionDecoder&) = delete;
    ~MotionDecoder() { ::jpeg_destroy_decompress(&jpeg); }

    [[noreturn]] static void leave(j_common_ptr common) {
        auto& self = *static_cast<MotionDecoder*>(common->client_data);
        common->err->format_message(common, self.error);
        std::longjmp(self.way_out, 1);
    }

    bool read_header(std::span<const std::byte> bytes) {
        if (setjmp(way_out) != 0) return false;
        ::jpeg_create_decompress(&jpeg);
        ::jpeg_mem_src(&jpeg, reinterpret_cast<const unsigned char*>(bytes.data()), bytes.size());
        ::jpeg_read_header(&jpeg, TRUE);
        return true;
    }
    bool start() {
        if (setjmp(way_out) != 0) return false;
        jpeg.out_color_space = JCS_RGB;
        jpeg.dct_method = JDCT_ISLOW;
        return ::jpeg_start_decompress(&jpeg) == TRUE;
    }
    bool read_row(JSAMPROW row) {
        if (setjmp(way_out) != 0) return false;
        return ::jpeg_read_scanlines(&jpeg, &row, 1) == 1;
    }
    /// Also looks at what follows the last row: it must be a picture's end.
    bool finish() {
        if (setjmp(way_out) != 0) return false;
        return ::jpeg_finish_decompress(&jpeg) == TRUE;
    }

    jpeg_decompress_struct jpeg{};
    jpeg_error_mgr errors{};
    std::jmp_buf way_out{};
    char error[JMSG_LENGTH_MAX] = "";
};

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
    MotionDecoder decoder;
    if (!decoder.read_header(jpeg)) refuse_jpeg(std::string("is damaged: ") + decoder.error);
    const auto& header = decoder.jpeg;
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
    if (good && first + rows == height) good = decoder.finish();
    if (!good) refuse_jpeg(std::string("is damaged or cut short: ") + decoder.error);
    return result;
}

}  // namespace darkbox
