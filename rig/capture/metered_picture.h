#pragma once

#include <cstdint>
#include <vector>

#include "acquisition/frame/frame.h"

namespace darkbox {

/// A frame's brightest channel at some pixels spread evenly over it (of a mosaic and of ycc8: its samples, its luma),
/// as shares of full scale above the black level. The same pixels for all frames of one size.
std::vector<float> metered_pixels(const Frame& frame);

/// Which of these pixels show the object: those that are bright in the mean over all lamps (Otsu's threshold, "A
/// threshold selection method from gray-level histograms", 1979). A mirror ball's highlights, each of them under one
/// lamp only, and the backdrop stay out.
std::vector<bool> object_pixels(const std::vector<std::vector<float>>& lamps);

/// The level that one pixel of the object in a thousand exceeds.
double object_level(const std::vector<float>& pixels, const std::vector<bool>& object);

}  // namespace darkbox
