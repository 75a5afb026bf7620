#include <cstdio>
#include <string>
#include <vector>

#include "acquisition/frame/jpeg_decoder.h"
#include "processing/formats/picture_header.h"
#include "processing/formats/row_decoders.h"

// jerror.h needs jpeglib.h.
#include <jerror.h>

namespace darkbox {
namespace {

namespace fs = std::filesystem;

/// libjpeg makes up the rest of a picture that ends early and only warns.
void leave_when_cut_short(j_common_ptr common, int level) {
    const int code = common->err->msg_code;
    if (level < 0 && (code == JWRN_JPEG_EOF || code == JWRN_HIT_MARKER || code == JWRN_HUFF_BAD_CODE))
        JpegDecoder::leave(common);
}

bool is_cmyk(const JpegDecoder& decoder) {
    return decoder.decompress.jpeg_color_space == JCS_CMYK || decoder.decompress.jpeg_color_space == JCS_YCCK;
}

bool read_header(JpegDecoder& decoder, std::FILE* file) {
    if (setjmp(decoder.way_out) != 0) return false;
    ::jpeg_create_decompress(&decoder.decompress);
    ::jpeg_stdio_src(&decoder.decompress, file);
    ::jpeg_read_header(&decoder.decompress, TRUE);
    decoder.decompress.out_color_space = is_cmyk(decoder) ? JCS_CMYK : JCS_RGB;
    return true;
}

/// What is printed reflects what its ink and its black let through. Adobe's files hold that, others the ink itself.
void rgb_from_cmyk(const std::vector<uchar>& cmyk, bool inverted, uchar* rgb) {
    const auto through = [&](std::size_t i) { return inverted ? cmyk[i] : 255 - cmyk[i]; };
    for (std::size_t i = 0; i < cmyk.size(); i += 4)
        for (std::size_t c = 0; c < 3; ++c) *rgb++ = static_cast<uchar>((through(i + c) * through(i + 3) + 127) / 255);
}

class JpegRows : public PictureRows {
public:
    JpegRows(const std::string& file, FileHandle handle, std::unique_ptr<JpegDecoder> decoder)
        : PictureRows(
              {static_cast<int>(decoder->decompress.image_width), static_cast<int>(decoder->decompress.image_height)},
              CV_8UC3),
          file_(file),
          handle_(std::move(handle)),
          decoder_(std::move(decoder)) {}

    void read(cv::Mat& rows) override {
        if (!started_) started_ = decoder_->start();
        bool good = started_;
        for (int y = 0; good && y < rows.rows; ++y)
            good = is_cmyk(*decoder_) ? read_cmyk(rows.ptr(y)) : decoder_->read_row(rows.ptr(y));
        if (!good) throw bad_picture(file_, std::string("is damaged or cut short: ") + decoder_->error);
    }

private:
    bool read_cmyk(uchar* rgb) {
        cmyk_.resize(4 * static_cast<std::size_t>(size().width));
        if (!decoder_->read_row(cmyk_.data())) return false;
        rgb_from_cmyk(cmyk_, decoder_->decompress.saw_Adobe_marker != 0, rgb);
        return true;
    }

    std::string file_;
    FileHandle handle_;
    std::unique_ptr<JpegDecoder> decoder_;
    std::vector<uchar> cmyk_;
    bool started_ = false;
};

}  // namespace

std::unique_ptr<PictureRows> open_jpeg_rows(const fs::path& path) {
    const std::string file = path.string();
    FileHandle handle = open_for_reading(path);
    auto decoder = std::make_unique<JpegDecoder>(leave_when_cut_short);
    if (!read_header(*decoder, handle.get()))
        throw bad_picture(file, std::string("is damaged or cut short: ") + decoder->error);
    require_sane_size(decoder->decompress.image_width, decoder->decompress.image_height, file);
    return std::make_unique<JpegRows>(file, std::move(handle), std::move(decoder));
}

}  // namespace darkbox
