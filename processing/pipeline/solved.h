#pragma once

#include "processing/normals/photometric_stereo.h"

namespace darkbox {

/// Throws InputError when photometric stereo told the normal of no pixel at all, and says why as far as `stack`, the
/// photographs that were solved or some of their rows, tells.
void require_any_normal(const PhotometricStereoResult& solved, const PhotoStack& stack);

}  // namespace darkbox
