#include <png.h>

#include <csetjmp>
#include <string>
#include <vector>

#include "processing/formats/picture_header.h"
#include "processing/formats/row_decoders.h"

namespace darkbox {
namespace {

namespace fs = std::filesystem;

/// libpng leaves its functions by longjmp on errors: those that call them hold nothing that needs a destructor.
struct PngDecoder {
    PngDecoder() : png(::png_create_read_struct(PNG_LIBPNG_VER_STRING, this, keep_error, ignore_warning)) {
        if (png) info = ::png_create_info_struct(png);
    }
    PngDecoder(const PngDecoder&) = delete;
    PngDecoder& operator=(const PngDecoder&) = delete;
    ~PngDecoder() { ::png_destroy_read_struct(&png, &info, nullptr); }

    [[noreturn]] static void keep_error(png_structp png, png_const_charp message) {
        static_cast<PngDecoder*>(::png_get_error_ptr(png))->error = message;
        ::png_longjmp(png, 1);
    }
    static void ignore_warning(png_structp, png_const_charp) {}

    png_structp png;
    png_infop info = nullptr;
    std::string error;
};

/// Every kind of PNG becomes R, G, B of 8 or 16 bits in this machine's byte order.
void ask_for_rgb(png_structp png, png_infop info) {
    ::png_set_palette_to_rgb(png);
    ::png_set_expand_gray_1_2_4_to_8(png);
    ::png_set_strip_alpha(png);
    ::png_set_gray_to_rgb(png);
    if (::png_get_bit_depth(png, info) == 16) ::png_set_swap(png);
    ::png_set_interlace_handling(png);
    ::png_read_update_info(png, info);
}

bool read_header(PngDecoder& decoder, std::FILE* file) {
    if (!decoder.png || !decoder.info) return false;
    if (setjmp(png_jmpbuf(decoder.png)) != 0) return false;
    ::png_init_io(decoder.png, file);
    ::png_set_user_limits(decoder.png, 0x7fffffff, 0x7fffffff);  // darkbox has its own
    ::png_read_info(decoder.png, decoder.info);
    return true;
}

bool set_transforms(PngDecoder& decoder) {
    if (setjmp(png_jmpbuf(decoder.png)) != 0) return false;
    ask_for_rgb(decoder.png, decoder.info);
    return true;
}

bool read_rows(PngDecoder& decoder, png_bytepp rows, png_uint_32 count) {
    if (setjmp(png_jmpbuf(decoder.png)) != 0) return false;
    ::png_read_rows(decoder.png, rows, nullptr, count);
    return true;
}

/// Interlaced: rows are complete only when all are.
bool read_image(PngDecoder& decoder, png_bytepp rows) {
    if (setjmp(png_jmpbuf(decoder.png)) != 0) return false;
    ::png_read_image(decoder.png, rows);
    return true;
}

/// The checksums after the last row.
bool read_end(PngDecoder& decoder) {
    if (setjmp(png_jmpbuf(decoder.png)) != 0) return false;
    ::png_read_end(decoder.png, nullptr);
    return true;
}

std::vector<png_bytep> row_pointers(cv::Mat& rows) {
    std::vector<png_bytep> pointers(static_cast<std::size_t>(rows.rows));
    for (int y = 0; y < rows.rows; ++y) pointers[static_cast<std::size_t>(y)] = rows.ptr(y);
    return pointers;
}

cv::Size size_of(const PngDecoder& decoder) {
    return {static_cast<int>(::png_get_image_width(decoder.png, decoder.info)),
            static_cast<int>(::png_get_image_height(decoder.png, decoder.info))};
}

int type_of(const PngDecoder& decoder) {
    return ::png_get_bit_depth(decoder.png, decoder.info) == 16 ? CV_16UC3 : CV_8UC3;
}

class PngRows : public PictureRows {
public:
    PngRows(const std::string& file, FileHandle handle, std::unique_ptr<PngDecoder> decoder)
        : PictureRows(size_of(*decoder), type_of(*decoder)),
          file_(file),
          handle_(std::move(handle)),
          decoder_(std::move(decoder)) {}

    void read(cv::Mat& rows) override {
        std::vector<png_bytep> pointers = row_pointers(rows);
        next_ += rows.rows;
        const bool good = read_rows(*decoder_, pointers.data(), static_cast<png_uint_32>(rows.rows)) &&
                          (next_ < size().height || read_end(*decoder_));
        if (!good) throw bad_picture(file_, "is damaged or cut short: " + decoder_->error);
    }

private:
    std::string file_;
    FileHandle handle_;
    std::unique_ptr<PngDecoder> decoder_;
    int next_ = 0;
};

}  // namespace

std::unique_ptr<PictureRows> open_png_rows(const fs::path& path) {
    const std::string file = path.string();
    FileHandle handle = open_for_reading(path);
    auto decoder = std::make_unique<PngDecoder>();
    if (!read_header(*decoder, handle.get())) throw bad_picture(file, "is damaged or cut short: " + decoder->error);
    require_sane_size(::png_get_image_width(decoder->png, decoder->info),
                      ::png_get_image_height(decoder->png, decoder->info), file);
    if (!set_transforms(*decoder)) throw bad_picture(file, "is damaged: " + decoder->error);
    if (::png_get_interlace_type(decoder->png, decoder->info) != PNG_INTERLACE_NONE) {
        cv::Mat whole(size_of(*decoder), type_of(*decoder));
        if (!read_image(*decoder, row_pointers(whole).data()) || !read_end(*decoder))
            throw bad_picture(file, "is damaged or cut short: " + decoder->error);
        return rows_of(whole);
    }
    return std::make_unique<PngRows>(file, std::move(handle), std::move(decoder));
}

}  // namespace darkbox
