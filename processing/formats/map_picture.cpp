#include "processing/formats/map_picture.h"

#include <cstring>

#include "acquisition/frame/error.h"
#include "processing/formats/picture.h"
#include "processing/formats/png.h"

namespace darkbox {
namespace {

cv::Mat read_samples_through(const cv::Mat& samples, const cv::Mat2i& coordinates) {
    cv::Mat result = cv::Mat::zeros(coordinates.size(), samples.type());
    const std::size_t pixel = samples.elemSize();
    for (int y = 0; y < result.rows; ++y)
        for (int x = 0; x < result.cols; ++x) {
            const cv::Vec2i& at = coordinates(y, x);
            if (at[0] >= 0) std::memcpy(result.ptr(y, x), samples.ptr(at[1], at[0]), pixel);
        }
    return result;
}

}  // namespace

MapPicture MapPicture::read_through(const cv::Mat2i& coordinates) const {
    MapPicture result;
    if (!samples.empty()) result.samples = read_samples_through(samples, coordinates);
    for (const ExrChannel& channel : channels)
        result.channels.push_back({channel.name, read_samples_through(channel.values, coordinates)});
    return result;
}

MapPicture read_map_picture(const std::filesystem::path& path) {
    switch (picture_format_of(path).value_or(PictureFormat::jpeg)) {
        case PictureFormat::exr:
            return {{}, read_exr_channels(path)};
        case PictureFormat::png:
            return {read_png(path), {}};
        default:
            throw InputError(path.string() + " is neither .png nor .exr", "convert it to one of them");
    }
}

void write_map_picture(const std::filesystem::path& path, const MapPicture& map) {
    if (map.channels.empty())
        write_png(path, map.samples);
    else
        write_exr(path, map.channels);
}

}  // namespace darkbox
