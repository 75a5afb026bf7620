#include "processing/formats/demosaic.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <opencv2/imgproc.hpp>

#include "acquisition/frame/error.h"

namespace darkbox {
namespace {

constexpr int reach = demosaic_margin;
constexpr int side = 2 * reach + 1;

/// In sixteenths.
using Kernel = std::array<std::array<int, side>, side>;

constexpr Kernel green_at_colour{
    {{0, 0, -2, 0, 0}, {0, 0, 4, 0, 0}, {-2, 4, 8, 4, -2}, {0, 0, 4, 0, 0}, {0, 0, -2, 0, 0}}};
constexpr Kernel colour_of_the_row{
    {{0, 0, 1, 0, 0}, {0, -2, 0, -2, 0}, {-2, 8, 10, 8, -2}, {0, -2, 0, -2, 0}, {0, 0, 1, 0, 0}}};
constexpr Kernel colour_of_the_column{
    {{0, 0, -2, 0, 0}, {0, -2, 8, -2, 0}, {1, 0, 10, 0, 1}, {0, -2, 8, -2, 0}, {0, 0, -2, 0, 0}}};
constexpr Kernel colour_across{
    {{0, 0, -3, 0, 0}, {0, 4, 0, 4, 0}, {-3, 0, 12, 0, -3}, {0, 4, 0, 4, 0}, {0, 0, -3, 0, 0}}};

/// `row` and `column` in a picture that has been given its margins.
template <typename Sample>
Sample interpolate(const cv::Mat_<Sample>& raw, int row, int column, const Kernel& kernel, int full_scale) {
    int sum = 0;
    for (int y = 0; y < side; ++y) {
        const Sample* samples = raw[row + y] + column;
        for (int x = 0; x < side; ++x) {
            const int weight = kernel[static_cast<std::size_t>(y)][static_cast<std::size_t>(x)];
            if (weight == 0) continue;
            if (samples[x] >= full_scale) return static_cast<Sample>(full_scale);
            sum += weight * samples[x];
        }
    }
    return static_cast<Sample>(std::clamp((sum + 8) >> 4, 0, full_scale));
}

template <typename Sample>
cv::Mat demosaic_samples(const cv::Mat& raw, int first_row, Mosaic mosaic, int full_scale) {
    cv::Mat_<Sample> wide;
    cv::copyMakeBorder(raw, wide, 0, 0, reach, reach, cv::BORDER_REFLECT_101);
    cv::Mat_<cv::Vec<Sample, 3>> rgb(raw.rows - 2 * reach, raw.cols);
    for (int row = 0; row < rgb.rows; ++row) {
        const bool red_row = (first_row + row) % 2 == mosaic.red_row;
        for (int column = 0; column < rgb.cols; ++column) {
            const bool red_column = column % 2 == mosaic.red_column;
            const auto with = [&](const Kernel& kernel) { return interpolate(wide, row, column, kernel, full_scale); };
            const Sample own = wide(row + reach, column + reach);
            auto& pixel = rgb(row, column);
            if (red_row == red_column) {
                const Sample other = with(colour_across);
                pixel = {red_row ? own : other, with(green_at_colour), red_row ? other : own};
            } else {
                const Sample in_row = with(colour_of_the_row);
                const Sample in_column = with(colour_of_the_column);
                pixel = {red_row ? in_row : in_column, own, red_row ? in_column : in_row};
            }
        }
    }
    return rgb;
}

}  // namespace

cv::Mat demosaic(const cv::Mat& raw, int first_row, Mosaic mosaic, int full_scale) {
    if (raw.cols < reach + 1 || raw.rows <= 2 * reach)
        throw InputError(
            fmt::format("a mosaic of {} columns and {} rows with their margins; at least {} and {} are needed",
                        raw.cols, raw.rows, reach + 1, 2 * reach + 1),
            "use a picture of at least 3 x 3 pixels");
    return raw.depth() == CV_8U ? demosaic_samples<std::uint8_t>(raw, first_row, mosaic, full_scale)
                                : demosaic_samples<std::uint16_t>(raw, first_row, mosaic, full_scale);
}

}  // namespace darkbox
