#pragma once

#include <opencv2/core.hpp>

#include "acquisition/frame/progress.h"
#include "processing/transfer/pyramid.h"
#include "processing/transfer/transfer.h"

namespace darkbox {

/// Source coordinates of every valid target pixel, (-1, -1) elsewhere, by Image Analogies (Hertzmann et al. 2001) with
/// A = source normals, A' = source albedo, B = target normals (thesis, texture replacement): coarse to fine, causal
/// windows, approximate nearest neighbours, coherence search (Ashikhmin 2001). `white` is the albedo that counts as
/// such. The result does not depend on the number of TBB's threads. Throws Cancelled.
cv::Mat2i analogies(const MapPyramid& source, MapPyramid target, float white, const TransferOptions& options,
                    const WorkContext& work);

}  // namespace darkbox
