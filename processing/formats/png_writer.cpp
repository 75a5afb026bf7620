#include <fmt/format.h>
#include <png.h>
#include <zlib.h>

#include <csetjmp>
#include <cstring>
#include <exception>
#include <span>
#include <string>

#include "acquisition/frame/error.h"
#include "processing/formats/atomic_file.h"
#include "processing/formats/png.h"

namespace darkbox {
namespace {

using Sink = std::function<void(std::span<const std::byte>)>;

/// libpng leaves its functions by longjmp on errors: those that call them hold nothing that needs a destructor.
struct PngEncoder {
    explicit PngEncoder(const Sink& to)
        : sink(to), png(::png_create_write_struct(PNG_LIBPNG_VER_STRING, this, keep_error, ignore_warning)) {
        if (png) info = ::png_create_info_struct(png);
    }
    PngEncoder(const PngEncoder&) = delete;
    PngEncoder& operator=(const PngEncoder&) = delete;
    ~PngEncoder() { ::png_destroy_write_struct(&png, &info); }

    [[noreturn]] static void keep_error(png_structp png, png_const_charp message) {
        static_cast<PngEncoder*>(::png_get_error_ptr(png))->error = message;
        ::png_longjmp(png, 1);
    }
    static void ignore_warning(png_structp, png_const_charp) {}

    /// Exceptions must not pass through libpng: they wait here.
    static void write(png_structp png, png_bytep bytes, std::size_t count) {
        auto& encoder = *static_cast<PngEncoder*>(::png_get_io_ptr(png));
        try {
            encoder.sink({reinterpret_cast<const std::byte*>(bytes), count});
        } catch (...) {
            encoder.failure = std::current_exception();
        }
        if (encoder.failure) ::png_error(png, "cannot write");
    }
    static void flush(png_structp) {}

    const Sink& sink;
    png_structp png;
    png_infop info = nullptr;
    std::string error;
    std::exception_ptr failure;
};

/// Differences to the left neighbour and run lengths: little slower than not compressing at all.
bool write_header(PngEncoder& encoder, cv::Size size, int type) {
    if (!encoder.png || !encoder.info) return false;
    if (setjmp(png_jmpbuf(encoder.png)) != 0) return false;
    constexpr std::size_t written_at_once = 1 << 18;
    ::png_set_write_fn(encoder.png, &encoder, PngEncoder::write, PngEncoder::flush);
    ::png_set_compression_buffer_size(encoder.png, written_at_once);
    ::png_set_filter(encoder.png, PNG_FILTER_TYPE_BASE, PNG_FILTER_SUB);
    ::png_set_compression_level(encoder.png, Z_BEST_SPEED);
    ::png_set_compression_strategy(encoder.png, Z_RLE);
    ::png_set_IHDR(encoder.png, encoder.info, static_cast<png_uint_32>(size.width),
                   static_cast<png_uint_32>(size.height), CV_MAT_DEPTH(type) == CV_16U ? 16 : 8,
                   CV_MAT_CN(type) == 3 ? PNG_COLOR_TYPE_RGB : PNG_COLOR_TYPE_GRAY, PNG_INTERLACE_NONE,
                   PNG_COMPRESSION_TYPE_BASE, PNG_FILTER_TYPE_BASE);
    ::png_write_info(encoder.png, encoder.info);
    if (CV_MAT_DEPTH(type) == CV_16U) ::png_set_swap(encoder.png);
    return true;
}

bool write_row(PngEncoder& encoder, png_const_bytep row) {
    if (setjmp(png_jmpbuf(encoder.png)) != 0) return false;
    ::png_write_row(encoder.png, row);
    return true;
}

bool write_end(PngEncoder& encoder) {
    if (setjmp(png_jmpbuf(encoder.png)) != 0) return false;
    ::png_write_end(encoder.png, nullptr);
    return true;
}

void encode(cv::Size size, int type, const FillPngRow& fill, const Sink& sink) {
    const bool known = type == CV_8UC1 || type == CV_8UC3 || type == CV_16UC1 || type == CV_16UC3;
    PngEncoder encoder(sink);
    bool good = known && !size.empty() && write_header(encoder, size, type);
    std::vector<uchar> row(static_cast<std::size_t>(size.width) * CV_ELEM_SIZE(type));
    for (int y = 0; good && y < size.height; ++y) {
        fill(y, row.data());
        good = write_row(encoder, row.data());
    }
    if (good && write_end(encoder)) return;
    if (encoder.failure) std::rethrow_exception(encoder.failure);
    throw InputError(fmt::format("cannot encode a picture of {}x{} pixels: {}", size.width, size.height, encoder.error),
                     "report this as a bug");
}

FillPngRow filled_from(const cv::Mat& image) {
    return [&image](int row, uchar* samples) {
        std::memcpy(samples, image.ptr(row), static_cast<std::size_t>(image.cols) * image.elemSize());
    };
}

}  // namespace

std::vector<std::byte> encode_png(const cv::Mat& image) {
    std::vector<std::byte> png;
    encode(image.size(), image.type(), filled_from(image),
           [&](std::span<const std::byte> bytes) { png.insert(png.end(), bytes.begin(), bytes.end()); });
    return png;
}

void write_png_rows(const std::filesystem::path& path, cv::Size size, int type, const FillPngRow& fill) {
    AtomicFile file(path);
    encode(size, type, fill, [&](std::span<const std::byte> bytes) { file.write(bytes); });
    file.commit();
}

void write_png(const std::filesystem::path& path, const cv::Mat& image) {
    write_png_rows(path, image.size(), image.type(), filled_from(image));
}

}  // namespace darkbox
