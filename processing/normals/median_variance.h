#pragma once

#include "processing/normals/least_squares.h"

namespace darkbox {

/// The median over valid pixels of residual squared over degrees of freedom; 0 where fewer than four lights tell
/// nothing. Pictures of millions of pixels are represented by evenly spaced rows.
float median_variance(const SolvedMaps& maps);

}  // namespace darkbox
