#include "processing/formats/environment_file.h"

#include <fmt/format.h>

#include <cmath>

#include "processing/formats/atomic_file.h"
#include "processing/formats/bytes.h"
#include "processing/formats/exr.h"
#include "processing/formats/picture.h"
#include "processing/formats/radiance_hdr.h"

namespace darkbox {
namespace {

namespace fs = std::filesystem;

void require_light(const cv::Mat3f& radiance, const std::string& file) {
    for (const cv::Vec3f& p : radiance)
        for (int c = 0; c < 3; ++c)
            if (!std::isfinite(p[c]) || p[c] < 0)
                throw bad_picture(file, "has radiance that is negative or not a finite number");
}

}  // namespace

Environment read_environment(const fs::path& path) {
    const bool exr = picture_format_of(path) == PictureFormat::exr;
    Environment environment{exr ? read_exr_colour(path) : decode_radiance_hdr(read_file(path), path.string())};
    require_light(environment.radiance, path.string());
    if (environment.radiance.cols != 2 * environment.radiance.rows)
        throw InputError(fmt::format("{} is {}x{} pixels; an equirectangular environment is twice as wide as high",
                                     path.string(), environment.radiance.cols, environment.radiance.rows),
                         "convert the probe to equirectangular (latitude-longitude) form");
    return environment;
}

}  // namespace darkbox
