#include "processing/normals/body_law.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace darkbox {
namespace {

constexpr float smallest_cosine = 0.05F;

/// Fresnel's reflectance for unpolarised light that meets index n at the angle of this cosine.
double fresnel(double cosine, double index) {
    const double refracted = std::sqrt(1.0 - (1.0 - cosine * cosine) / (index * index));
    const double s = (cosine - index * refracted) / (cosine + index * refracted);
    const double p = (refracted - index * cosine) / (refracted + index * cosine);
    return 0.5 * (s * s + p * p);
}

}  // namespace

std::string BodyLaw::name() const {
    switch (kind) {
        case BodyKind::lambert:
            return "lambert";
        case BodyKind::smooth:
            return fmt::format("smooth {:.2f}", parameter);
        case BodyKind::rough:
            return fmt::format("rough {:.2f}", parameter);
    }
    return {};
}

const std::vector<BodyLaw>& body_laws() {
    static const std::vector<BodyLaw> laws{{BodyKind::lambert, 0},  {BodyKind::smooth, 1.15}, {BodyKind::smooth, 1.3},
                                           {BodyKind::smooth, 1.5}, {BodyKind::rough, 0.15},  {BodyKind::rough, 0.25},
                                           {BodyKind::rough, 0.4}};
    return laws;
}

BodyFactor::BodyFactor(const BodyLaw& law) : kind_(law.kind) {
    if (kind_ == BodyKind::rough) {
        const double variance = law.parameter * law.parameter;
        const double facing = 1.0 - 0.5 * variance / (variance + 0.33);
        slope_ = static_cast<float>(0.45 * variance / (variance + 0.09) / facing);
    }
    if (kind_ == BodyKind::smooth) {
        const double facing = 1.0 - fresnel(1.0, law.parameter);
        for (int i = 0; i <= steps; ++i)
            entering_[static_cast<std::size_t>(i)] =
                static_cast<float>((1.0 - fresnel(static_cast<double>(i) / steps, law.parameter)) / facing);
    }
}

float BodyFactor::operator()(float n_dot_l, float n_dot_v, float l_dot_v) const {
    if (kind_ == BodyKind::lambert) return 1.0F;
    const float to_light = std::clamp(n_dot_l, smallest_cosine, 1.0F);
    if (kind_ == BodyKind::smooth) {
        const float place = to_light * steps;
        const int below = std::min(static_cast<int>(place), steps - 1);
        const auto at = static_cast<std::size_t>(below);
        return entering_[at] + (place - static_cast<float>(below)) * (entering_[at + 1] - entering_[at]);
    }
    const float to_view = std::clamp(n_dot_v, smallest_cosine, 1.0F);
    const float opposed = l_dot_v - to_light * to_view;
    return 1.0F + slope_ * std::max(opposed, 0.0F) / std::max(to_light, to_view);
}

}  // namespace darkbox
