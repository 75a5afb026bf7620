#include "processing/normals/noise_model.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "acquisition/frame/error.h"

namespace darkbox {

double NoiseModel::variance(double radiance) const {
    return read_sigma * read_sigma + shot_gain * std::max(radiance, 0.0) + quantisation * quantisation / 12.0;
}

void NoiseModel::validate() const {
    const auto require = [](const char* field, double value) {
        if (!(std::isfinite(value) && value >= 0))
            throw InputError(fmt::format("{} of the noise is {}", field, value), "allowed: 0 or more, linear radiance");
    };
    require("read_sigma", read_sigma);
    require("shot_gain", shot_gain);
    require("quantisation", quantisation);
}

}  // namespace darkbox
