#pragma once

#include <functional>
#include <opencv2/core.hpp>

#include "processing/transfer/expected_look.h"
#include "processing/transfer/pyramid.h"
#include "processing/transfer/transfer.h"

namespace darkbox {

/// One level of a transfer that is to be refined.
struct RefinementLevel {
    const MapLevel& source;
    MapLevel& target;          ///< its albedo is written
    const ExpectedLook& look;  ///< of the finest source
    int level;                 ///< 0 is the finest
    float white;               ///< albedo that is displayed as 255
};

/// Called before each pass; may throw to stop the work.
using PassBegins = std::function<void()>;

/// Lowers the energy of texture optimisation (Kwatra et al. 2005, equation 1) over source coordinates: the sum over all
/// pixels of the squared difference of the window around a pixel to that around its source pixel, colours as displayed
/// and normals alike. Unlike a synthesis in scan-line order it looks at whole windows, and at what a change does to the
/// windows of the neighbours. Two more terms keep a transfer true to its source: the blurred colour is to be what the
/// source has where it faces the same way, and source pixels are to be used as often as normals like theirs occur on
/// the target.
///
/// Candidates are what continues the neighbours, and pixels that look like it in the source (k-coherence, Tong et al.
/// 2002), like the source by its normal, and random ones at growing distance (PatchMatch, Barnes et al. 2009). Pixels
/// change in nine interleaved groups, those of a group at once, so the result does not depend on threads.
cv::Mat2i refine_level(const RefinementLevel& level, const cv::Mat2i& coordinates, const TransferOptions& options,
                       const PassBegins& pass_begins);

}  // namespace darkbox
