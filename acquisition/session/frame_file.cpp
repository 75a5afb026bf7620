#include "acquisition/session/frame_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cstdint>
#include <utility>

#include "acquisition/frame/error.h"
#include "acquisition/frame/motion_jpeg.h"
#include "acquisition/session/durable_file.h"
#include "acquisition/session/tiff_handle.h"

namespace darkbox {
namespace {

namespace fs = std::filesystem;

static_assert(std::endian::native == std::endian::little, "Frame samples are little-endian words");

constexpr std::size_t strip_bytes = 64 * 1024;
constexpr std::size_t largest_jpeg = std::size_t{256} << 20;

std::size_t row_bytes(int width, PixelFormat format) {
    return static_cast<std::size_t>(width) * channels(format) * bytes_per_sample(format);
}

void require_sound(const Frame& frame) {
    const bool sized = frame.width > 0 && frame.height > 0;
    const std::size_t expected = sized ? row_bytes(frame.width, frame.format) * frame.height : 0;
    if (!sized || frame.pixels.size() != expected)
        throw InputError(fmt::format("a {} x {} {} frame with {} bytes of pixels, {} expected", frame.width,
                                     frame.height, name(frame.format), frame.pixels.size(), expected),
                         "the camera driver delivered an incomplete frame; take it again");
    const int most = 8 * bytes_per_sample(frame.format);
    if (frame.format == PixelFormat::mjpg && frame.jpeg.empty())
        throw InputError("a frame of format mjpg without its JPEG", "the camera driver is at fault; take it again");
    if (frame.bit_depth < 1 || frame.bit_depth > most)
        throw InputError(
            fmt::format("bit_depth {} of a {} frame; allowed are 1 to {}", frame.bit_depth, name(frame.format), most),
            "check the camera driver's pixel format");
}

[[noreturn]] void throw_damaged(const fs::path& file, const std::string& why) {
    throw InputError(fmt::format("{}: {}", file.string(), why),
                     "the file is damaged or not of this session; darkbox verify tells which files are good");
}

PixelFormat captured_format(const fs::path& file, const FrameRecord& record) {
    const auto format = pixel_format_from_name(record.format);
    if (!format)
        throw InputError(fmt::format("{}: format \"{}\" is not that of a captured frame", file.string(), record.format),
                         "imported pictures are read by their own decoder");
    return *format;
}

void require_inside(const fs::path& file, const FrameRecord& record, RowBand band) {
    if (band.first < 0 || band.count < 1 || band.first > record.height - band.count)
        throw InputError(fmt::format("{}: {} rows from row {} asked for, it has {}", file.string(), band.count,
                                     band.first, record.height),
                         "ask for rows inside the picture");
}

std::uint32_t number_tag(TIFF* tiff, ttag_t tag) {
    std::uint32_t value = 0;
    return ::TIFFGetField(tiff, tag, &value) == 1 ? value : 0;
}

std::uint16_t short_tag(TIFF* tiff, ttag_t tag) {
    std::uint16_t value = 0;
    return ::TIFFGetFieldDefaulted(tiff, tag, &value) == 1 ? value : std::uint16_t{0};
}

/// Besides catching a wrong file this bounds what is allocated: uncompressed pixels are no larger than their file.
void require_match(TIFF* tiff, const fs::path& file, const FrameRecord& record, PixelFormat format) {
    const auto width = number_tag(tiff, TIFFTAG_IMAGEWIDTH);
    const auto height = number_tag(tiff, TIFFTAG_IMAGELENGTH);
    if (width != static_cast<std::uint32_t>(record.width) || height != static_cast<std::uint32_t>(record.height))
        throw_damaged(file, fmt::format("it is {} x {} pixels, the session says {} x {}", width, height, record.width,
                                        record.height));
    const int samples = short_tag(tiff, TIFFTAG_SAMPLESPERPIXEL);
    const int bits = short_tag(tiff, TIFFTAG_BITSPERSAMPLE);
    const bool plain = short_tag(tiff, TIFFTAG_COMPRESSION) == COMPRESSION_NONE &&
                       short_tag(tiff, TIFFTAG_PLANARCONFIG) == PLANARCONFIG_CONTIG &&
                       short_tag(tiff, TIFFTAG_SAMPLEFORMAT) == SAMPLEFORMAT_UINT && ::TIFFIsTiled(tiff) == 0;
    if (!plain || samples != channels(format) || bits != 8 * bytes_per_sample(format))
        throw_damaged(file,
                      fmt::format("it holds {} samples of {} bits, the session says {}", samples, bits, record.format));
    if (fs::file_size(file) < row_bytes(record.width, format) * record.height) throw_damaged(file, "it is cut short");
}

void set_tags(TIFF* tiff, const Frame& frame) {
    const bool colour = channels(frame.format) == 3;
    const std::size_t rows = std::max<std::size_t>(1, strip_bytes / row_bytes(frame.width, frame.format));
    ::TIFFSetField(tiff, TIFFTAG_IMAGEWIDTH, static_cast<std::uint32_t>(frame.width));
    ::TIFFSetField(tiff, TIFFTAG_IMAGELENGTH, static_cast<std::uint32_t>(frame.height));
    ::TIFFSetField(tiff, TIFFTAG_SAMPLESPERPIXEL, channels(frame.format));
    ::TIFFSetField(tiff, TIFFTAG_BITSPERSAMPLE, 8 * bytes_per_sample(frame.format));
    ::TIFFSetField(tiff, TIFFTAG_MAXSAMPLEVALUE, (1 << frame.bit_depth) - 1);
    ::TIFFSetField(tiff, TIFFTAG_SAMPLEFORMAT, SAMPLEFORMAT_UINT);
    ::TIFFSetField(tiff, TIFFTAG_PHOTOMETRIC, colour ? PHOTOMETRIC_RGB : PHOTOMETRIC_MINISBLACK);
    if (channels(frame.format) == 2) {  // chroma beside the luma, which other programs then show as grey
        const std::uint16_t beside = EXTRASAMPLE_UNSPECIFIED;
        ::TIFFSetField(tiff, TIFFTAG_EXTRASAMPLES, 1, &beside);
    }
    ::TIFFSetField(tiff, TIFFTAG_PLANARCONFIG, PLANARCONFIG_CONTIG);
    ::TIFFSetField(tiff, TIFFTAG_ORIENTATION, ORIENTATION_TOPLEFT);
    ::TIFFSetField(tiff, TIFFTAG_COMPRESSION, COMPRESSION_NONE);
    ::TIFFSetField(tiff, TIFFTAG_ROWSPERSTRIP, static_cast<std::uint32_t>(rows));
}

Frame frame_of(const FrameRecord& record, PixelFormat format, RowBand band) {
    Frame frame;
    frame.width = record.width;
    frame.height = band.count;
    frame.format = format;
    frame.bit_depth = record.bit_depth;
    frame.black_level = record.black_level;
    frame.sequence = record.sequence;
    frame.timestamp = TimePoint(Nanoseconds(record.timestamp_ns));
    frame.controls = {Seconds(record.exposure_s), record.gain};
    return frame;
}

Frame read_jpeg(const fs::path& file, const FrameRecord& record, RowBand band) {
    const std::string bytes = read_text(file, largest_jpeg);
    Frame frame = frame_of(record, PixelFormat::mjpg, band);
    try {
        frame.pixels = decode_motion_jpeg(bytes_of(bytes), record.width, record.height, band.first, band.count);
    } catch (const InputError& error) {
        throw_damaged(file, error.what());
    }
    const auto whole = bytes_of(bytes);
    if (band.first == 0 && band.count == record.height) frame.jpeg.assign(whole.begin(), whole.end());
    return frame;
}

}  // namespace

std::vector<std::byte> encode_frame(const Frame& frame) {
    if (frame.format != PixelFormat::mjpg) return encode_frame_tiff(frame);
    require_sound(frame);
    return frame.jpeg;
}

std::vector<std::byte> encode_frame_tiff(const Frame& frame) {
    require_sound(frame);
    const std::size_t row = row_bytes(frame.width, frame.format);
    MemoryFile memory;
    memory.bytes.reserve(frame.pixels.size() + strip_bytes);
    TiffMessages messages;
    TiffHandle tiff = open_tiff_for_writing(memory, messages);
    bool good = tiff != nullptr;
    if (good) set_tags(tiff.get(), frame);
    for (int y = 0; good && y < frame.height; ++y) {
        // libtiff takes the row as mutable, but swaps bytes in place only when the file's byte order is the other one.
        auto* source = const_cast<std::byte*>(frame.pixels.data() + y * row);
        good = ::TIFFWriteScanline(tiff.get(), source, static_cast<std::uint32_t>(y)) == 1;
    }
    good = good && ::TIFFFlush(tiff.get()) == 1;
    tiff.reset();
    if (!good || !messages.first_error.empty())
        throw InputError("the frame cannot be encoded as TIFF: " + messages.first_error, "take it again");
    return std::move(memory.bytes);
}

Frame read_frame(const fs::path& file, const FrameRecord& record) {
    return read_frame_rows(file, record, {0, record.height});
}

Frame read_frame_rows(const fs::path& file, const FrameRecord& record, RowBand band) {
    const PixelFormat format = captured_format(file, record);
    require_inside(file, record, band);
    if (format == PixelFormat::mjpg) return read_jpeg(file, record, band);
    TiffMessages messages;
    const TiffHandle tiff = open_tiff(file, messages);
    if (!tiff) throw_damaged(file, messages.first_error.empty() ? "it is not a TIFF" : messages.first_error);
    require_match(tiff.get(), file, record, format);

    Frame frame = frame_of(record, format, band);
    const std::size_t row = row_bytes(frame.width, format);
    if (static_cast<std::size_t>(::TIFFScanlineSize(tiff.get())) != row) throw_damaged(file, "its rows are too long");
    frame.pixels.resize(row * band.count);
    for (int y = 0; y < band.count; ++y)
        if (::TIFFReadScanline(tiff.get(), frame.pixels.data() + y * row, static_cast<std::uint32_t>(band.first + y)) !=
            1)
            throw_damaged(file, messages.first_error);
    return frame;
}

}  // namespace darkbox
