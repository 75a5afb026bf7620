#include "processing/formats/environment_file.h"

#include <fmt/format.h>

#include <cmath>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "processing/formats/atomic_file.h"
#include "processing/formats/bytes.h"
#include "processing/formats/exr.h"
#include "processing/formats/picture.h"

namespace darkbox {
namespace {

namespace fs = std::filesystem;

cv::Mat3f read_radiance_hdr(const fs::path& path) {
    const std::vector<std::byte> bytes = read_file(path);
    const ByteReader reader(bytes, ByteReader::Order::big, path.string());
    if (bytes.size() < 2 || reader.text(0, 2) != "#?")
        throw bad_picture(path.string(), "is not a Radiance .hdr picture");
    const cv::Mat buffer(1, static_cast<int>(bytes.size()), CV_8U, const_cast<std::byte*>(bytes.data()));
    cv::Mat decoded;
    try {
        decoded = cv::imdecode(buffer, cv::IMREAD_ANYDEPTH | cv::IMREAD_COLOR);
    } catch (const cv::Exception&) {
        decoded.release();
    }
    if (decoded.type() != CV_32FC3 || decoded.empty()) throw bad_picture(path.string(), "is damaged or cut short");
    cv::cvtColor(decoded, decoded, cv::COLOR_BGR2RGB);
    return decoded;
}

void require_light(const cv::Mat3f& radiance, const std::string& file) {
    for (const cv::Vec3f& p : radiance)
        for (int c = 0; c < 3; ++c)
            if (!std::isfinite(p[c]) || p[c] < 0)
                throw bad_picture(file, "has radiance that is negative or not a finite number");
}

}  // namespace

Environment read_environment(const fs::path& path) {
    const bool exr = picture_format_of(path) == PictureFormat::exr;
    Environment environment{exr ? read_exr_colour(path) : read_radiance_hdr(path)};
    require_light(environment.radiance, path.string());
    if (environment.radiance.cols != 2 * environment.radiance.rows)
        throw InputError(fmt::format("{} is {}x{} pixels; an equirectangular environment is twice as wide as high",
                                     path.string(), environment.radiance.cols, environment.radiance.rows),
                         "convert the probe to equirectangular (latitude-longitude) form");
    return environment;
}

}  // namespace darkbox
