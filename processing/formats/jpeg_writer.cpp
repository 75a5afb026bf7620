#include "processing/formats/jpeg_writer.h"

#include <csetjmp>
#include <cstdio>
#include <cstdlib>
#include <memory>

#include <jpeglib.h>  // needs <cstdio> before it

#include <fmt/format.h>

#include "acquisition/frame/error.h"

namespace darkbox {
namespace {

/// libjpeg's way out of an error is a function that must not return.
struct Failure {
    jpeg_error_mgr manager;
    std::jmp_buf way_out;
};

[[noreturn]] void leave(j_common_ptr codec) { std::longjmp(reinterpret_cast<Failure*>(codec->err)->way_out, 1); }

enum class Chroma { full, halved };

struct Buffer {
    unsigned char* bytes = nullptr;
    unsigned long size = 0;
    ~Buffer() { std::free(bytes); }
};

/// Holds nothing with a destructor, since longjmp would pass it by. False when libjpeg gave up.
bool compress(const cv::Mat3b& image, int quality, Chroma chroma, Buffer& buffer) {
    jpeg_compress_struct codec;
    Failure failure;
    codec.err = jpeg_std_error(&failure.manager);
    failure.manager.error_exit = leave;
    if (setjmp(failure.way_out) != 0) {
        jpeg_destroy_compress(&codec);
        return false;
    }
    jpeg_create_compress(&codec);
    jpeg_mem_dest(&codec, &buffer.bytes, &buffer.size);
    codec.image_width = static_cast<JDIMENSION>(image.cols);
    codec.image_height = static_cast<JDIMENSION>(image.rows);
    codec.input_components = 3;
    codec.in_color_space = JCS_RGB;
    jpeg_set_defaults(&codec);
    jpeg_set_quality(&codec, quality, TRUE);
    const int across = chroma == Chroma::halved ? 2 : 1;
    codec.comp_info[0].h_samp_factor = codec.comp_info[0].v_samp_factor = across;
    for (int c = 1; c < 3; ++c) codec.comp_info[c].h_samp_factor = codec.comp_info[c].v_samp_factor = 1;
    jpeg_start_compress(&codec, TRUE);
    for (int y = 0; y < image.rows; ++y) {
        JSAMPROW row = const_cast<JSAMPROW>(image.ptr<uchar>(y));  // libjpeg only reads it
        jpeg_write_scanlines(&codec, &row, 1);
    }
    jpeg_finish_compress(&codec);
    jpeg_destroy_compress(&codec);
    return true;
}

std::vector<std::byte> encoded(const cv::Mat3b& image, int quality, Chroma chroma) {
    Buffer buffer;
    if (image.empty() || !compress(image, quality, chroma, buffer))
        throw InputError(fmt::format("a picture of {}x{} pixels cannot be a JPEG", image.cols, image.rows),
                         "crop the photographs to at most 65500 pixels a side");
    const auto* bytes = reinterpret_cast<const std::byte*>(buffer.bytes);
    return {bytes, bytes + buffer.size};
}

}  // namespace

std::vector<std::byte> encode_jpeg(const cv::Mat3b& image, int quality) {
    return encoded(image, quality, Chroma::halved);
}

std::vector<std::byte> encode_data_jpeg(const cv::Mat3b& image, int quality) {
    return encoded(image, quality, Chroma::full);
}

}  // namespace darkbox
