#include "processing/normals/light_set.h"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <cmath>

#include "acquisition/frame/error.h"

namespace darkbox {
namespace {

std::array<float, 3> gain_of(const Light& light) {
    std::array<float, 3> gain{};
    for (int channel = 0; channel < 3; ++channel) {
        const double intensity = light.intensity[channel];
        if (!(std::isfinite(intensity) && intensity > 0))
            throw InputError(fmt::format("the intensity of the light of {} is {}", light.file, intensity),
                             "give every used light a positive intensity in each channel");
        gain[static_cast<std::size_t>(channel)] = static_cast<float>(1.0 / intensity);
    }
    return gain;
}

}  // namespace

LightSet LightSet::from(const Lights& lights) {
    require_solvable(lights);
    const auto directions = direction_matrix(lights);
    const Eigen::Matrix3d moments = directions.transpose() * directions;
    const Eigen::Matrix<double, 3, Eigen::Dynamic> pseudo_inverse = moments.inverse() * directions.transpose();

    LightSet set;
    set.condition_number = darkbox::condition_number(lights);
    for (std::size_t i = 0; i < lights.size(); ++i) {
        if (!lights[i].used) continue;
        const auto column = static_cast<Eigen::Index>(set.lights.size());
        set.lights.push_back(
            {i, lights[i].direction.cast<float>(), gain_of(lights[i]), pseudo_inverse.col(column).cast<float>()});
    }
    return set;
}

}  // namespace darkbox
