#pragma once

#include <opencv2/core.hpp>

#include "processing/transfer/pyramid.h"
#include "processing/transfer/transfer.h"

namespace darkbox {

/// Source coordinates of every valid target pixel, (-1, -1) elsewhere, within a few frames' time: the chunks of seed.h
/// at half the resolution, and nothing more. Cuts between them show. The result does not depend on the number of TBB's
/// threads.
cv::Mat2i preview(const MapLevel& source, const MapLevel& target, const TransferOptions& options);

}  // namespace darkbox
