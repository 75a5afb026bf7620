#include "processing/normals/bands.h"

#include <fmt/format.h>

#include <algorithm>

#include "acquisition/frame/error.h"
#include "processing/normals/least_squares.h"

namespace darkbox {
namespace {

constexpr std::size_t mebibyte = 1 << 20;
constexpr std::size_t bands_in_memory = 2;
constexpr std::size_t largest_band = 32 * mebibyte;  // more only costs memory: overlap and speed stay the same
constexpr std::size_t least_rows = 16;               // decoders work on that many rows at once

}  // namespace

int rows_of_a_band(const PhotoSource& photos, const PhotometricStereoOptions& options) {
    const cv::Size size = photos.size();
    if (options.band_rows > 0) return std::min(options.band_rows, std::max(size.height, 1));
    return rows_within(photos, static_cast<std::size_t>(size.area()) * SolvedMaps::bytes_per_pixel(),
                       options.memory_mib);
}

int rows_within(const PhotoSource& photos, std::size_t held, int memory_mib) {
    const cv::Size size = photos.size();
    const std::size_t row = photos.bytes_per_row();
    held += photos.bytes_held();
    const std::size_t budget = static_cast<std::size_t>(memory_mib) * mebibyte;
    if (held + bands_in_memory * row > budget)
        throw InputError(
            fmt::format("memory_mib is {}, but {} photographs of {}x{} pixels need {}", memory_mib, photos.count(),
                        size.width, size.height, (held + bands_in_memory * least_rows * row) / mebibyte + 1),
            "allow more memory with --memory-mib, or scale the photographs down");
    if (row == 0) return std::max(size.height, 1);
    const std::size_t fit = (budget - held) / (bands_in_memory * row);
    const std::size_t wanted = std::max(largest_band / row, least_rows);
    return static_cast<int>(std::clamp<std::size_t>(std::min(fit, wanted), 1, std::max(size.height, 1)));
}

}  // namespace darkbox
