#pragma once

#include <functional>
#include <opencv2/core.hpp>

#include "processing/transfer/features.h"
#include "processing/transfer/pyramid.h"
#include "processing/transfer/source_search.h"
#include "processing/transfer/transfer.h"

namespace darkbox {

/// One level of Image Analogies as it is synthesised: the source's and the target's maps at that level and at the
/// coarser one (null at the coarsest), which is synthesised already.
struct SynthesisLevel {
    const MapLevel& source;
    const MapLevel* coarse_source;
    MapLevel& target;  ///< its albedo is written
    const MapLevel* coarse_target;
    cv::Mat2i coarse_coordinates;  ///< empty at the coarsest level
    double coherence;              ///< 2^(l - L) kappa: how much farther a coherent match may be, as a share
};

/// How SourceSearch looks for the global match.
struct GlobalMatch {
    bool exact;
    std::uint64_t seed;
};

/// Called with the number of finished rows, from the calling thread; may throw to stop the work.
using RowsDone = std::function<void(int rows)>;

/// Source coordinates of every valid target pixel of the level, (-1, -1) elsewhere. Each pixel, in scan-line order,
/// takes the source pixel whose feature is nearest among all, or the one that continues a neighbour's (Ashikhmin 2001)
/// where that one's distance is at most (1 + coherence) times as large (Hertzmann et al. 2001, section 3.3).
/// Runs on TBB's threads as a wavefront; the result does not depend on their number.
cv::Mat2i synthesise_level(const SynthesisLevel& level, const FeatureSpace& space, const GlobalMatch& global,
                           const RowsDone& rows_done);

}  // namespace darkbox
