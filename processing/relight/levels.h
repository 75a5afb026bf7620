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

/// sum += intensity x S(k, r), S by linear interpolation over r. `label` is 1...texels.
inline void add_shading(cv::Vec3f& sum, const cv::Vec3f& intensity, const ShadingMaps& maps, int label, float r) {
    const LevelPosition position(r, maps.levels);
    const cv::Vec3f* level = maps.radiance[label - 1] + position.below;
    for (int c = 0; c < 3; ++c)
        sum[c] += intensity[c] * (level[0][c] + position.fraction * (level[1][c] - level[0][c]));
}

}  // namespace darkbox
