#pragma once

#include "acquisition/frame/progress.h"
#include "processing/maps/maps.h"

namespace darkbox {

struct ShadingOptions {
    int levels = 11;  ///< entries r = 0, 1/(levels-1), ..., 1; 2...256

    /// Throws InputError that names the field and the allowed range.
    void validate() const;
};

struct ShadingResult {
    ShadingMaps maps;
    double seconds = 0;
};

/// S(k, r) from every photograph and pixel: samples (r = N.L, RGB / intensity) of each texel, sorted by r and
/// re-sampled at the levels by linear interpolation, extrapolated or scaled where no sample reaches (thesis, shading
/// maps; Kautz et al. 2004). Clipped samples are left out. S(k, 0) = 0. Bit-identical on any number of threads. Throws
/// InputError on sizes that differ.
ShadingResult shading_maps(const PhotoStack& stack, const Lights& lights, const NormalMap& normals,
                           const AlbedoMap& albedo, const IndexMap& index, const ShadingOptions& options = {},
                           const WorkContext& work = {});

}  // namespace darkbox
