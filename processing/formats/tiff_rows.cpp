#include <tiffio.h>

#include <algorithm>
#include <array>
#include <cstdarg>
#include <cstdio>
#include <cstring>
#include <string>
#include <vector>

#include "processing/formats/picture_header.h"
#include "processing/formats/row_decoders.h"

namespace darkbox {
namespace {

namespace fs = std::filesystem;

struct TiffDeleter {
    void operator()(TIFF* tiff) const noexcept { ::TIFFClose(tiff); }
    void operator()(TIFFOpenOptions* options) const noexcept { ::TIFFOpenOptionsFree(options); }
};
using TiffFile = std::unique_ptr<TIFF, TiffDeleter>;

int keep_first_error(TIFF*, void* user_data, const char*, const char* format, va_list arguments) {
    auto& error = *static_cast<std::string*>(user_data);
    std::array<char, 512> text{};
    std::vsnprintf(text.data(), text.size(), format, arguments);
    if (error.empty()) error = text.data();
    return 1;  // handled: libtiff does not print it
}
int drop_warning(TIFF*, void*, const char*, const char*, va_list) { return 1; }

/// Not mapped into memory ("m"): the pages of every file that was read would count as the program's own.
TiffFile open_tiff_file(const fs::path& path, std::string& error) {
    const std::unique_ptr<TIFFOpenOptions, TiffDeleter> options(::TIFFOpenOptionsAlloc());
    ::TIFFOpenOptionsSetErrorHandlerExtR(options.get(), keep_first_error, &error);
    ::TIFFOpenOptionsSetWarningHandlerExtR(options.get(), drop_warning, nullptr);
    return TiffFile(::TIFFOpenExt(path.c_str(), "rm", options.get()));
}

std::uint16_t short_tag(TIFF* tiff, ttag_t tag) {
    std::uint16_t value = 0;
    return ::TIFFGetFieldDefaulted(tiff, tag, &value) == 1 ? value : std::uint16_t{0};
}
std::uint32_t number_tag(TIFF* tiff, ttag_t tag) {
    std::uint32_t value = 0;
    return ::TIFFGetField(tiff, tag, &value) == 1 ? value : 0;
}

/// How samples lie in a decoded row.
struct Samples {
    int depth = CV_8U;
    int channels = 3;  ///< grey or R, G, B first, then what is left out, such as alpha
    bool grey() const { return channels < 3; }
};

/// No value for palettes, separate planes, inverted grey and odd bit depths.
std::optional<Samples> plain_samples(TIFF* tiff) {
    const int bits = short_tag(tiff, TIFFTAG_BITSPERSAMPLE), channels = short_tag(tiff, TIFFTAG_SAMPLESPERPIXEL);
    const int photometric = short_tag(tiff, TIFFTAG_PHOTOMETRIC), format = short_tag(tiff, TIFFTAG_SAMPLEFORMAT);
    const bool colours = (photometric == PHOTOMETRIC_RGB && channels >= 3) ||
                         (photometric == PHOTOMETRIC_MINISBLACK && (channels == 1 || channels == 2));
    if (!colours || short_tag(tiff, TIFFTAG_PLANARCONFIG) != PLANARCONFIG_CONTIG) return std::nullopt;
    const bool whole = format == SAMPLEFORMAT_UINT;
    if (whole && bits == 8) return Samples{CV_8U, channels};
    if (whole && bits == 16) return Samples{CV_16U, channels};
    if (format == SAMPLEFORMAT_IEEEFP && bits == 32) return Samples{CV_32F, channels};
    return std::nullopt;
}

/// Decoded rows of the file, one after the other.
class TiffRows : public PictureRows {
public:
    TiffRows(std::string file, cv::Size size, Samples samples, std::unique_ptr<std::string> error, TiffFile tiff)
        : PictureRows(size, CV_MAKETYPE(samples.depth, 3)),
          file_(std::move(file)),
          samples_(samples),
          error_(std::move(error)),
          tiff_(std::move(tiff)),
          row_bytes_(static_cast<std::size_t>(size.width) * pixel_bytes()) {
        if (::TIFFIsTiled(tiff_.get()) != 0) {
            tile_ = {static_cast<int>(number_tag(tiff_.get(), TIFFTAG_TILEWIDTH)),
                     static_cast<int>(number_tag(tiff_.get(), TIFFTAG_TILELENGTH))};
            require_sane_size(static_cast<std::uint64_t>(tile_.width), static_cast<std::uint64_t>(tile_.height), file_);
        } else if (static_cast<std::size_t>(::TIFFScanlineSize(tiff_.get())) != row_bytes_) {
            throw bad_picture(file_, "is damaged: its rows have a wrong length");
        }
    }

    void read(cv::Mat& rows) override {
        const bool as_stored = samples_.channels == 3;
        if (!as_stored) stored_.resize(row_bytes_);
        for (int y = 0; y < rows.rows; ++y, ++next_) {
            read_row(as_stored ? rows.ptr(y) : stored_.data());
            if (!as_stored) pick_colours(rows, y);
        }
        if (samples_.depth == CV_32F) require_finite(rows, next_ - rows.rows, file_);
    }

private:
    std::size_t pixel_bytes() const {
        return CV_ELEM_SIZE1(samples_.depth) * static_cast<std::size_t>(samples_.channels);
    }

    void read_row(uchar* row) {
        if (tile_.height > 0) return read_tiled_row(row);
        if (::TIFFReadScanline(tiff_.get(), row, static_cast<std::uint32_t>(next_)) != 1) throw damaged();
    }

    void read_tiled_row(uchar* row) {
        if (next_ % tile_.height == 0) read_tiles();
        std::memcpy(row, tiles_.data() + static_cast<std::size_t>(next_ % tile_.height) * row_bytes_, row_bytes_);
    }

    /// The row of tiles that begins at the next row, side by side.
    void read_tiles() {
        const std::size_t tile_row = static_cast<std::size_t>(tile_.width) * pixel_bytes();
        std::vector<uchar> tile(static_cast<std::size_t>(::TIFFTileSize(tiff_.get())));
        if (tile.size() != tile_row * static_cast<std::size_t>(tile_.height))
            throw bad_picture(file_, "is damaged: its tiles have a wrong size");
        tiles_.resize(row_bytes_ * static_cast<std::size_t>(tile_.height));
        for (int x = 0; x < size().width; x += tile_.width) {
            if (::TIFFReadTile(tiff_.get(), tile.data(), static_cast<std::uint32_t>(x),
                               static_cast<std::uint32_t>(next_), 0, 0) < 0)
                throw damaged();
            const std::size_t at = static_cast<std::size_t>(x) * pixel_bytes(),
                              part = std::min(tile_row, row_bytes_ - at);
            for (std::size_t y = 0; y < static_cast<std::size_t>(tile_.height); ++y)
                std::memcpy(tiles_.data() + y * row_bytes_ + at, tile.data() + y * tile_row, part);
        }
    }

    void pick_colours(cv::Mat& rows, int y) {
        const cv::Mat stored(1, rows.cols, CV_MAKETYPE(samples_.depth, samples_.channels), stored_.data());
        cv::Mat row = rows.row(y);
        const std::array<int, 6> from_to =
            samples_.grey() ? std::array{0, 0, 0, 1, 0, 2} : std::array{0, 0, 1, 1, 2, 2};
        cv::mixChannels(&stored, 1, &row, 1, from_to.data(), 3);
    }

    InputError damaged() const { return bad_picture(file_, "is damaged or cut short: " + *error_); }

    std::string file_;
    Samples samples_;
    std::unique_ptr<std::string> error_;  ///< where libtiff's handle keeps on writing
    TiffFile tiff_;
    std::size_t row_bytes_;
    cv::Size tile_;
    std::vector<uchar> tiles_, stored_;
    int next_ = 0;
};

/// What libtiff makes 8 bits of R, G, B of.
cv::Mat3b read_as_8_bits(TIFF* tiff, cv::Size size, const std::string& file, const std::string& error) {
    if (short_tag(tiff, TIFFTAG_BITSPERSAMPLE) > 8)
        throw InputError(file + " has a kind of samples that darkbox does not read",
                         "save it with 8 or 16 bits or as 32-bit float, its colours interleaved");
    std::vector<std::uint32_t> packed(static_cast<std::size_t>(size.area()));
    if (::TIFFReadRGBAImageOriented(tiff, static_cast<std::uint32_t>(size.width),
                                    static_cast<std::uint32_t>(size.height), packed.data(), ORIENTATION_TOPLEFT,
                                    1) != 1)
        throw bad_picture(file, "is damaged or cut short: " + error);
    cv::Mat3b samples(size);
    std::transform(packed.begin(), packed.end(), samples.begin(),
                   [](std::uint32_t abgr) { return cv::Vec3b(TIFFGetR(abgr), TIFFGetG(abgr), TIFFGetB(abgr)); });
    return samples;
}

}  // namespace

std::unique_ptr<PictureRows> open_tiff_rows(const fs::path& path) {
    open_for_reading(path);  // for its errors, which say more than libtiff's
    const std::string file = path.string();
    auto error = std::make_unique<std::string>();
    TiffFile tiff = open_tiff_file(path, *error);
    if (!tiff) throw bad_picture(file, "is damaged or cut short: " + *error);
    const auto width = number_tag(tiff.get(), TIFFTAG_IMAGEWIDTH), height = number_tag(tiff.get(), TIFFTAG_IMAGELENGTH);
    require_sane_size(width, height, file);
    const auto samples = plain_samples(tiff.get());
    const cv::Size size(static_cast<int>(width), static_cast<int>(height));
    if (!samples) return rows_of(read_as_8_bits(tiff.get(), size, file, *error));
    return std::make_unique<TiffRows>(file, size, *samples, std::move(error), std::move(tiff));
}

}  // namespace darkbox
