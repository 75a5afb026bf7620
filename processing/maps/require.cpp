#include "processing/maps/require.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "acquisition/frame/error.h"

namespace darkbox {
namespace {

constexpr double unit_tolerance = 1e-3;

std::string name_of(const Light& light) { return light.file.empty() ? "a light" : "the light of " + light.file; }

void require_light(const Light& light) {
    const double length = light.direction.norm();
    if (!(std::abs(length - 1.0) <= unit_tolerance))
        throw InputError(fmt::format("the direction of {} has length {:.4g} instead of 1", name_of(light), length),
                         "give a unit vector from the object to the light");
    if (!light.intensity.allFinite() || light.intensity.minCoeff() < 0)
        throw InputError(fmt::format("the intensity of {} is {:.4g}, {:.4g}, {:.4g}: none may be negative",
                                     name_of(light), light.intensity[0], light.intensity[1], light.intensity[2]),
                         "correct the intensity, or mark the light as not used");
}

}  // namespace

void require_size(const char* name, cv::Size size, cv::Size expected) {
    if (size != expected)
        throw InputError(fmt::format("{} is {}x{} pixels instead of {}x{}", name, size.width, size.height,
                                     expected.width, expected.height),
                         "give maps and photographs of one object, all of one size");
}

void require_labels(const IndexMap& index) {
    const auto highest = std::max_element(index.label.begin(), index.label.end());
    if (highest != index.label.end() && *highest > index.texels)
        throw InputError(fmt::format("the index map holds label {} but has {} texels", *highest, index.texels),
                         "compute the texels again");
}

void require_lights(const Lights& lights) {
    for (const Light& light : lights)
        if (light.used) require_light(light);
    if (std::none_of(lights.begin(), lights.end(), [](const Light& light) { return light.used; }))
        throw InputError("there is no light to use", "give at least one light");
}

}  // namespace darkbox
