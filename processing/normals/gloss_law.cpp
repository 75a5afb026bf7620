#include "processing/normals/gloss_law.h"

#include <fmt/format.h>

#include <cmath>

namespace darkbox {

std::string GlossLaw::name() const {
    return present() ? fmt::format("phong {:.3f} n {:.0f}", strength, exponent) : "none";
}

GlossAt gloss_at(const GlossLaw& law, const Eigen::Vector3f& normal, const Eigen::Vector3f& light,
                 const Eigen::Vector3f& view) {
    const float to_light = normal.dot(light), to_view = normal.dot(view);
    const float mirrored = 2.0F * to_light * to_view - light.dot(view);
    if (!(to_light > 0) || !(mirrored > 0)) return {};
    const auto exponent = static_cast<float>(law.exponent);
    const float value = static_cast<float>(law.strength) * std::pow(mirrored, exponent);
    return {value, (2.0F * exponent * value / mirrored) * (to_view * light + to_light * view)};
}

}  // namespace darkbox
