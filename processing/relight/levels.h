#pragma once

#include <algorithm>
#include <opencv2/core.hpp>

#include "processing/maps/maps.h"

namespace darkbox {

/// Where a coefficient falls between two levels; beyond the last level it is clamped.
struct LevelPosition {
    int below;
    float fraction;  ///< 0 = at `below`, 1 = at the level above

    LevelPosition(float r, int levels) {
        const float position = std::clamp(r, 0.0F, 1.0F) * static_cast<float>(levels - 1);
        below = std::min(static_cast<int>(position), levels - 2);
        fraction = position - static_cast<float>(below);
    }
};

/// S(k, r) by linear interpolation over r. `label` is 1...texels.
inline cv::Vec3f shading_at(const ShadingMaps& maps, int label, float r) {
    const LevelPosition position(r, maps.levels);
    const cv::Vec3f* row = maps.radiance[label - 1] + position.below;
    return row[0] * (1 - position.fraction) + row[1] * position.fraction;
}

}  // namespace darkbox
