#include "acquisition/camera/sensor_layout.h"

#include <fmt/format.h>
#include <linux/videodev2.h>

#include <algorithm>
#include <array>
#include <cstring>

#include "acquisition/frame/error.h"
#include "acquisition/frame/motion_jpeg.h"

namespace darkbox {
namespace {

/// Luma of video runs from 16 to 235 (Rec. ITU-R BT.601).
constexpr double video_black = 16;
constexpr std::uint32_t y12p = v4l2_fourcc('Y', '1', '2', 'P');  // younger than Debian 12's headers

using enum PixelFormat;
using enum Packing;

constexpr std::array formats{
    SensorFormat{V4L2_PIX_FMT_Y16, grey16, 16, words},
    SensorFormat{V4L2_PIX_FMT_SRGGB16, rggb16, 16, words},
    SensorFormat{V4L2_PIX_FMT_SGRBG16, grbg16, 16, words},
    SensorFormat{V4L2_PIX_FMT_SGBRG16, gbrg16, 16, words},
    SensorFormat{V4L2_PIX_FMT_SBGGR16, bggr16, 16, words},
    SensorFormat{V4L2_PIX_FMT_Y12, grey16, 12, words},
    SensorFormat{y12p, grey16, 12, mipi12},
    SensorFormat{V4L2_PIX_FMT_SRGGB12, rggb16, 12, words},
    SensorFormat{V4L2_PIX_FMT_SGRBG12, grbg16, 12, words},
    SensorFormat{V4L2_PIX_FMT_SGBRG12, gbrg16, 12, words},
    SensorFormat{V4L2_PIX_FMT_SBGGR12, bggr16, 12, words},
    SensorFormat{V4L2_PIX_FMT_SRGGB12P, rggb16, 12, mipi12},
    SensorFormat{V4L2_PIX_FMT_SGRBG12P, grbg16, 12, mipi12},
    SensorFormat{V4L2_PIX_FMT_SGBRG12P, gbrg16, 12, mipi12},
    SensorFormat{V4L2_PIX_FMT_SBGGR12P, bggr16, 12, mipi12},
    SensorFormat{V4L2_PIX_FMT_Y10, grey16, 10, words},
    SensorFormat{V4L2_PIX_FMT_Y10P, grey16, 10, mipi10},
    SensorFormat{V4L2_PIX_FMT_Y10BPACK, grey16, 10, bits10},
    SensorFormat{V4L2_PIX_FMT_SRGGB10, rggb16, 10, words},
    SensorFormat{V4L2_PIX_FMT_SGRBG10, grbg16, 10, words},
    SensorFormat{V4L2_PIX_FMT_SGBRG10, gbrg16, 10, words},
    SensorFormat{V4L2_PIX_FMT_SBGGR10, bggr16, 10, words},
    SensorFormat{V4L2_PIX_FMT_SRGGB10P, rggb16, 10, mipi10},
    SensorFormat{V4L2_PIX_FMT_SGRBG10P, grbg16, 10, mipi10},
    SensorFormat{V4L2_PIX_FMT_SGBRG10P, gbrg16, 10, mipi10},
    SensorFormat{V4L2_PIX_FMT_SBGGR10P, bggr16, 10, mipi10},
    SensorFormat{V4L2_PIX_FMT_GREY, grey8, 8, bytes},
    SensorFormat{V4L2_PIX_FMT_SRGGB8, rggb8, 8, bytes},
    SensorFormat{V4L2_PIX_FMT_SGRBG8, grbg8, 8, bytes},
    SensorFormat{V4L2_PIX_FMT_SGBRG8, gbrg8, 8, bytes},
    SensorFormat{V4L2_PIX_FMT_SBGGR8, bggr8, 8, bytes},
    SensorFormat{V4L2_PIX_FMT_RGB24, rgb8, 8, bytes},
    SensorFormat{V4L2_PIX_FMT_YUYV, ycc8, 8, bytes, video_black},
    SensorFormat{V4L2_PIX_FMT_NV12, ycc8, 8, luma_last, video_black},
    SensorFormat{V4L2_PIX_FMT_MJPEG, mjpg, 16, jpeg},
};

constexpr const char* driver_hint = "the camera's driver is at fault: try another format of [camera]";

void require_sound(const SensorLayout& layout) {
    if (layout.width < 1 || layout.height < 1)
        throw InputError(fmt::format("a picture of {} x {} pixels", layout.width, layout.height), driver_hint);
    if (layout.format.format == ycc8 && layout.width % 2 != 0)
        throw InputError(fmt::format("{} pixels in a row of {}, whose chroma is shared by two", layout.width,
                                     fourcc_name(layout.format.fourcc)),
                         "choose an even width in [camera]");
    const std::size_t row = row_bytes(layout.format, layout.width);
    if (layout.bytes_per_line < row)
        throw InputError(fmt::format("rows of {} bytes for {} pixels of {}; at least {} are needed",
                                     layout.bytes_per_line, layout.width, fourcc_name(layout.format.fourcc), row),
                         driver_hint);
}

unsigned at(std::span<const std::byte> row, std::size_t i) { return std::to_integer<unsigned>(row[i]); }

unsigned mipi10_sample(std::span<const std::byte> row, std::size_t x) {
    const std::size_t group = x / 4 * 5;
    return at(row, group + x % 4) << 2U | (at(row, group + 4) >> (2 * (x % 4)) & 3U);
}

unsigned mipi12_sample(std::span<const std::byte> row, std::size_t x) {
    const std::size_t group = x / 2 * 3;
    return at(row, group + x % 2) << 4U | (at(row, group + 2) >> (4 * (x % 2)) & 15U);
}

unsigned bits10_sample(std::span<const std::byte> row, std::size_t x) {
    const std::size_t bit = 10 * x;
    const unsigned pair = at(row, bit / 8) << 8U | at(row, bit / 8 + 1);
    return pair >> (6 - bit % 8) & 1023U;
}

template <typename Sample>
void put_words(std::span<const std::byte> row, std::size_t count, std::vector<std::byte>& to, Sample sample) {
    for (std::size_t x = 0; x < count; ++x) {
        const unsigned value = sample(row, x);
        to.push_back(static_cast<std::byte>(value & 255U));
        to.push_back(static_cast<std::byte>(value >> 8U));
    }
}

void put_row(Packing packing, std::span<const std::byte> row, std::size_t pixels, std::vector<std::byte>& to) {
    switch (packing) {
        case mipi10:
            return put_words(row, pixels, to, mipi10_sample);
        case mipi12:
            return put_words(row, pixels, to, mipi12_sample);
        case bits10:
            return put_words(row, pixels, to, bits10_sample);
        default:
            to.insert(to.end(), row.begin(), row.end());
    }
}

void put_luma_and_chroma(std::span<const std::byte> luma, std::span<const std::byte> chroma,
                         std::vector<std::byte>& to) {
    for (std::size_t x = 0; x < luma.size(); ++x) to.insert(to.end(), {luma[x], chroma[x]});
}

}  // namespace

std::span<const SensorFormat> sensor_formats() { return formats; }

std::optional<SensorFormat> sensor_format(std::uint32_t fourcc) {
    const auto found =
        std::find_if(formats.begin(), formats.end(), [&](const SensorFormat& f) { return f.fourcc == fourcc; });
    return found == formats.end() ? std::nullopt : std::optional(*found);
}

std::string fourcc_name(std::uint32_t fourcc) {
    std::string name;
    for (unsigned shift = 0; shift < 32; shift += 8) {
        const auto c = static_cast<char>(fourcc >> shift & 127U);
        name += c >= ' ' && c <= '~' ? c : '?';
    }
    while (!name.empty() && name.back() == ' ') name.pop_back();
    return name;
}

std::optional<std::uint32_t> fourcc_from_name(std::string_view name) {
    if (name.empty() || name.size() > 4) return std::nullopt;
    std::array<char, 4> c{' ', ' ', ' ', ' '};
    std::copy(name.begin(), name.end(), c.begin());
    if (!std::all_of(c.begin(), c.end(), [](char each) { return each >= ' ' && each <= '~'; })) return std::nullopt;
    return v4l2_fourcc(c[0], c[1], c[2], c[3]);
}

std::size_t row_bytes(const SensorFormat& format, int width) {
    const auto pixels = static_cast<std::size_t>(width);
    switch (format.packing) {
        case words:
            return 2 * pixels;
        case mipi10:
            return (pixels + 3) / 4 * 5;
        case mipi12:
            return (pixels + 1) / 2 * 3;
        case bits10:
            return (10 * pixels + 7) / 8;
        case jpeg:
            return 0;
        case luma_last:
            return pixels;
        case bytes:
            break;
    }
    return pixels * static_cast<std::size_t>(channels(format.format));
}

std::size_t payload_bytes(const SensorLayout& layout) {
    constexpr std::size_t empty_jpeg = 4;  // where it begins and where it ends
    if (layout.format.packing == jpeg) return empty_jpeg;
    const auto rows = static_cast<std::size_t>(layout.height);
    const std::size_t all_rows = layout.format.packing == luma_last ? rows + (rows + 1) / 2 : rows;
    return (all_rows - 1) * layout.bytes_per_line + row_bytes(layout.format, layout.width);
}

std::vector<std::byte> unpack(const SensorLayout& layout, std::span<const std::byte> payload) {
    require_sound(layout);
    if (payload.size() < payload_bytes(layout))
        throw InputError(fmt::format("{} of {} bytes of a {} x {} {} picture", payload.size(), payload_bytes(layout),
                                     layout.width, layout.height, fourcc_name(layout.format.fourcc)),
                         "check the camera's cable and the load on its bus");
    if (layout.format.packing == jpeg)
        return decode_motion_jpeg(payload, layout.width, layout.height, 0, layout.height);
    const auto pixels = static_cast<std::size_t>(layout.width);
    const auto rows = static_cast<std::size_t>(layout.height);
    const auto row = [&](std::size_t y) {
        return payload.subspan(y * layout.bytes_per_line, row_bytes(layout.format, layout.width));
    };
    std::vector<std::byte> samples;
    samples.reserve(rows * pixels * static_cast<std::size_t>(channels(layout.format.format)) *
                    static_cast<std::size_t>(bytes_per_sample(layout.format.format)));
    for (std::size_t y = 0; y < rows; ++y) {
        if (layout.format.packing == luma_last)
            put_luma_and_chroma(row(y), row(rows + y / 2), samples);
        else
            put_row(layout.format.packing, row(y), pixels, samples);
    }
    return samples;
}

}  // namespace darkbox
