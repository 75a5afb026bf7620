#pragma once

#include <opencv2/core.hpp>

#include "processing/maps/maps.h"

namespace darkbox {

// What several stages ask of their inputs. Each throws InputError that names what is wrong.

/// `name` as in "the albedo map".
void require_size(const char* name, cv::Size size, cv::Size expected);

/// Labels are 0...texels.
void require_labels(const IndexMap& index);

/// At least one used light; each used one with a unit direction and a finite intensity that is not negative.
void require_lights(const Lights& lights);

}  // namespace darkbox
