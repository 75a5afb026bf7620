#include <array>
#include <cstddef>
#include <string>
#include <vector>

#include "processing/formats/atomic_file.h"
#include "processing/formats/jpeg_writer.h"
#include "processing/formats/json_file.h"
#include "processing/formats/ptm_file.h"
#include "processing/formats/quantise.h"

namespace darkbox {
namespace {

using nlohmann::ordered_json;

/// The web format's order of terms, by their places in the PTM's.
constexpr std::array web_order = {PtmTerm::one, PtmTerm::u, PtmTerm::v, PtmTerm::uu, PtmTerm::uv, PtmTerm::vv};

/// One channel of a picture: a plane of coefficients as bytes.
struct Plane {
    cv::Mat1b bytes;
    ByteRange range;
};

Plane plane_of(const cv::Mat1f& values) {
    const ValueRange found = range_of(values);
    Plane plane;
    plane.range.scale = std::max((found.high - found.low) / 255.0, 1e-9);
    plane.range.bias = -found.low / plane.range.scale;
    plane.bytes.create(values.size());
    for (int y = 0; y < values.rows; ++y)
        for (int x = 0; x < values.cols; ++x) plane.bytes(y, x) = plane.range.byte(static_cast<double>(values(y, x)));
    return plane;
}

cv::Mat1f channel_of(const cv::Mat& values, int channel) {
    cv::Mat one;
    cv::extractChannel(values, one, channel);
    return one;
}

const cv::Mat& coefficient(const Ptm& ptm, std::size_t place) {
    return ptm.coefficient[static_cast<std::size_t>(web_order[place])];
}

/// The values behind channel `channel` of picture `picture`.
cv::Mat1f values_of(const Ptm& ptm, std::size_t picture, int channel) {
    if (ptm.model == PtmModel::rgb) return channel_of(coefficient(ptm, picture), channel);
    if (picture == 0) return channel_of(ptm.colour, channel);
    return coefficient(ptm, 3 * (picture - 1) + static_cast<std::size_t>(channel));
}

ordered_json info_of(const Ptm& ptm, const Lights& lights, int quality, const std::vector<ByteRange>& ranges) {
    ordered_json directions = ordered_json::array(), scale = ordered_json::array(), bias = ordered_json::array();
    for (const Light& light : lights)
        if (light.used)
            for (int i = 0; i < 3; ++i) directions.push_back(light.direction[i]);
    for (const ByteRange& range : ranges) {  // samples there are on 0...1
        scale.push_back(range.scale * 255.0);
        bias.push_back(range.bias / 255.0);
    }
    return {{"width", ptm.size().width},
            {"height", ptm.size().height},
            {"format", "jpg"},
            {"type", "ptm"},
            {"colorspace", ptm.model == PtmModel::rgb ? "rgb" : "lrgb"},
            {"nplanes", ranges.size()},
            {"quality", quality},
            {"lights", directions},
            {"materials", ordered_json::array({{{"scale", scale}, {"bias", bias}}})}};
}

}  // namespace

std::vector<std::filesystem::path> write_relight_web(const std::filesystem::path& folder, const Ptm& ptm,
                                                     const Lights& lights, int quality) {
    const std::size_t pictures = ptm.model == PtmModel::rgb ? 6 : 3;
    std::vector<ByteRange> ranges;
    std::vector<std::filesystem::path> written;
    for (std::size_t picture = 0; picture < pictures; ++picture) {
        std::vector<cv::Mat> channels;
        for (int channel = 0; channel < 3; ++channel) {
            const Plane plane = plane_of(values_of(ptm, picture, channel));
            ranges.push_back(plane.range);
            channels.push_back(plane.bytes);
        }
        cv::Mat3b image;
        cv::merge(channels, image);
        written.push_back(folder / ("plane_" + std::to_string(picture) + ".jpg"));
        write_file(written.back(), encode_data_jpeg(image, quality));
    }
    write_json(folder / "info.json", info_of(ptm, lights, quality, ranges));
    return written;
}

}  // namespace darkbox
