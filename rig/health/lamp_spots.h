#pragma once

#include <opencv2/core.hpp>
#include <optional>
#include <vector>

#include "processing/calibration/calibration.h"

namespace darkbox {

/// The mirror ball under one lamp (or none).
struct BallLook {
    cv::Mat1f light;        ///< above the black level; 1 = full scale
    double exposure_s = 0;  ///< in effect
};

/// A lamp's mirror image on the ball.
struct LampSpot {
    cv::Point2d at;        ///< pixels
    double strength = 0;   ///< its light in a second of exposure; every lamp's is alike, wherever it hangs
    bool clipped = false;  ///< it has more than that
};

/// Light of a lamp that was not asked for.
struct Leak {
    std::optional<std::size_t> commanded;  ///< lamp that was to burn; none: all were to be dark
    std::size_t leaking = 0;               ///< lamp that glowed along
    double share = 0;                      ///< of its full light
    double sigma = 0;                      ///< standard deviation of the share
};

/// Every lamp's spot: its place from the `shining` looks, one a lamp, its strength from the `brief` ones, whose
/// exposure is so short that the spot does not clip. No value for a lamp without a spot. A mirror ball spreads a
/// distant lamp's light evenly over all directions, so that strengths can be compared with each other.
std::vector<std::optional<LampSpot>> lamp_spots(const std::vector<BallLook>& shining,
                                                const std::vector<BallLook>& brief, const Ball& ball);

/// What each look shows at the other lamps' places that stands out from its surroundings by five standard deviations
/// and by more than `least_share` of that lamp's own light. Places beside the burning lamp's own spot tell nothing and
/// are left out.
std::vector<Leak> find_leaks(const std::vector<BallLook>& shining, const BallLook& dark,
                             const std::vector<std::optional<LampSpot>>& spots, const Ball& ball, double least_share);

}  // namespace darkbox
