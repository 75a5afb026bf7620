#include "acquisition/frame/pixel_format.h"

#include <array>

namespace darkbox {
namespace {

struct Row {
    PixelFormat format;
    std::string_view name;
    int channels;
    int bytes_per_sample;
    std::optional<Mosaic> mosaic = {};
};

constexpr std::array rows{
    Row{PixelFormat::grey8, "grey8", 1, 1},
    Row{PixelFormat::grey16, "grey16", 1, 2},
    Row{PixelFormat::rgb8, "rgb8", 3, 1},
    Row{PixelFormat::rgb16, "rgb16", 3, 2},
    Row{PixelFormat::rggb8, "rggb8", 1, 1, Mosaic{0, 0}},
    Row{PixelFormat::grbg8, "grbg8", 1, 1, Mosaic{0, 1}},
    Row{PixelFormat::gbrg8, "gbrg8", 1, 1, Mosaic{1, 0}},
    Row{PixelFormat::bggr8, "bggr8", 1, 1, Mosaic{1, 1}},
    Row{PixelFormat::rggb16, "rggb16", 1, 2, Mosaic{0, 0}},
    Row{PixelFormat::grbg16, "grbg16", 1, 2, Mosaic{0, 1}},
    Row{PixelFormat::gbrg16, "gbrg16", 1, 2, Mosaic{1, 0}},
    Row{PixelFormat::bggr16, "bggr16", 1, 2, Mosaic{1, 1}},
    Row{PixelFormat::mjpg, "mjpg", 3, 2},
    Row{PixelFormat::ycc8, "ycc8", 2, 1},
};

const Row& row_of(PixelFormat format) { return rows[static_cast<std::size_t>(format)]; }

}  // namespace

int channels(PixelFormat format) { return row_of(format).channels; }
int bytes_per_sample(PixelFormat format) { return row_of(format).bytes_per_sample; }
std::optional<Mosaic> mosaic(PixelFormat format) { return row_of(format).mosaic; }
std::string_view name(PixelFormat format) { return row_of(format).name; }

std::optional<PixelFormat> pixel_format_from_name(std::string_view name) {
    for (const Row& row : rows)
        if (row.name == name) return row.format;
    return std::nullopt;
}

}  // namespace darkbox
