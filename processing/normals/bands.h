#pragma once

#include <cstddef>

#include "processing/maps/photo_source.h"
#include "processing/normals/photometric_stereo.h"

namespace darkbox {

/// How many rows a band has, so that two bands, the maps and what the source holds stay within options.memory_mib; no
/// more than keep the processor's caches and both threads busy. Throws InputError that names memory_mib and what is
/// needed when not even two rows fit.
int rows_of_a_band(const PhotoSource& photos, const PhotometricStereoOptions& options);

/// The same for other work that holds `held` bytes beside the bands and what the source holds.
int rows_within(const PhotoSource& photos, std::size_t held, int memory_mib);

}  // namespace darkbox
