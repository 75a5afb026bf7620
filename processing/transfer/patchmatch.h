#pragma once

#include <functional>
#include <opencv2/core.hpp>

#include "processing/transfer/pyramid.h"
#include "processing/transfer/texel_bytes.h"
#include "processing/transfer/transfer.h"

namespace darkbox {

/// A map's pyramid, and that of its control map (as albedo), empty where there is none.
struct GuidedPyramid {
    MapPyramid maps;
    MapPyramid control;

    const MapLevel* control_at(int level) const { return control.empty() ? nullptr : &control[level]; }
};

/// Called with the number of finished passes of all; may throw to stop the work.
using PassesDone = std::function<void(int done, int all)>;

/// How many levels patchmatch works on: seeds at a quarter of the resolution are large enough to keep stones whole, and
/// small enough to follow the normals.
int patchmatch_levels(int asked, cv::Size source, cv::Size target);

/// Source coordinates of every valid target pixel, (-1, -1) elsewhere: chunks of the source are laid out at the
/// coarsest level (seed.h), then refined coarse to fine (refinement.h).
cv::Mat2i patchmatch(const GuidedPyramid& source, const GuidedPyramid& target, const TexelCode& code,
                     const TransferOptions& options, const PassesDone& passes_done);

}  // namespace darkbox
