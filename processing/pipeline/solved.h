#pragma once

#include "acquisition/frame/error.h"
#include "processing/normals/photometric_stereo.h"

namespace darkbox {

/// Throws InputError when photometric stereo told the normal of no pixel at all.
inline void require_any_normal(const PhotometricStereoResult& solved) {
    if (solved.pixels == 0)
        throw InputError("no pixel of the object is bright enough in the photographs to tell its normal",
                         "check that the mask is white on the object, and that the photographs show it lit");
}

}  // namespace darkbox
