#pragma once

#include <opencv2/core.hpp>

#include "processing/transfer/pyramid.h"

namespace darkbox {

/// Angle from each valid target normal to the nearest of the source's, degrees, too large by one at the most; 0
/// elsewhere. Where it is large, no texture can fit.
cv::Mat1f uncovered_deg(const MapLevel& source, const MapLevel& target);

}  // namespace darkbox
