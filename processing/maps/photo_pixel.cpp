#include "processing/maps/photo_pixel.h"

#include <algorithm>
#include <cstddef>
#include <type_traits>

namespace darkbox {
namespace {

template <class Sample>
cv::Vec3f radiance_of_pixel(const PhotoRows& rows, int row, int column) {
    const auto* s = rows.samples.ptr<Sample>(row) + 3 * static_cast<std::ptrdiff_t>(column);
    if constexpr (std::is_integral_v<Sample>)
        if (rows.curve) return {(*rows.curve)[s[0]], (*rows.curve)[s[1]], (*rows.curve)[s[2]]};
    const cv::Vec3f black = rows.dark.empty() ? cv::Vec3f::all(rows.black) : rows.dark(row, column);
    cv::Vec3f radiance;
    for (int c = 0; c < 3; ++c) radiance[c] = (static_cast<float>(s[c]) - black[c]) * rows.scale;
    return radiance;
}

template <class Sample>
bool reaches_limit(const PhotoRows& rows, int row, int column) {
    const auto* s = rows.samples.ptr<Sample>(row) + 3 * static_cast<std::ptrdiff_t>(column);
    return static_cast<float>(std::max({s[0], s[1], s[2]})) >= rows.limit;
}

}  // namespace

cv::Vec3f radiance_at(const PhotoRows& rows, int row, int column) {
    switch (rows.samples.depth()) {
        case CV_8U:
            return radiance_of_pixel<uchar>(rows, row, column);
        case CV_16U:
            return radiance_of_pixel<ushort>(rows, row, column);
        default:
            return radiance_of_pixel<float>(rows, row, column);
    }
}

bool clipped_at(const PhotoRows& rows, int row, int column) {
    if (!rows.clipped.empty()) return rows.clipped(row, column) != 0;
    switch (rows.samples.depth()) {
        case CV_8U:
            return reaches_limit<uchar>(rows, row, column);
        case CV_16U:
            return reaches_limit<ushort>(rows, row, column);
        default:
            return reaches_limit<float>(rows, row, column);
    }
}

}  // namespace darkbox
