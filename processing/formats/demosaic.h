#pragma once

#include <opencv2/core.hpp>

#include "acquisition/frame/pixel_format.h"

namespace darkbox {

/// A band of rows from behind a colour mosaic as R, G, B of the same depth, by the gradient-corrected linear
/// interpolation of Malvar, He and Cutler ("High-quality linear interpolation for demosaicing of Bayer-patterned color
/// images", ICASSP 2004, figure 2). A sample that was measured stays as it is. Exact where all colours share one
/// gradient; its weights sum to one, so that a black level stays where it was.
///
/// What is interpolated from a sample at `full_scale` comes out at full scale as well: the light that was cut off there
/// is missing in it, and who leaves clipped samples out leaves it out, too. Nothing exceeds 0...full_scale.
///
/// `raw`: CV_8UC1 or CV_16UC1, the band and, above and below it, `demosaic_margin` rows more: those of the picture, or
/// where it ends its rows mirrored about the outermost one (which keeps the colours' places). Sides are mirrored here.
/// `first_row`: the place of the band's own first row in the picture. Pictures of fewer than 3 rows or columns cannot
/// be mirrored: InputError.
cv::Mat demosaic(const cv::Mat& raw, int first_row, Mosaic mosaic, int full_scale);

inline constexpr int demosaic_margin = 2;

}  // namespace darkbox
