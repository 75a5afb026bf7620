#pragma once

#include "sim/image.h"
#include "sim/scene.h"

namespace darkbox::sim {

/// The picture moved to the right by a fraction of a pixel, too, by cubic interpolation (Keys 1981); what comes in on
/// the left repeats the border.
RgbImage shifted(const RgbImage& image, double right_px);

/// Blurred by a Gaussian of this standard deviation; the border is repeated outwards.
RgbImage blurred(const RgbImage& image, double sigma_px);

/// Takes the disc's pixels from `source`.
void copy_disc(const RgbImage& source, const BallCircle& disc, RgbImage& target);

}  // namespace darkbox::sim
