#pragma once

#include "acquisition/frame/progress.h"
#include "processing/maps/maps.h"
#include "processing/normals/light_field.h"

namespace darkbox {

struct ShadingOptions {
    int levels = 11;         ///< entries r = 0, 1/(levels-1), ..., 1; 2...256
    SceneGeometry geometry;  ///< for near lights

    /// Throws InputError that names the field and the allowed range.
    void validate() const;
};

struct ShadingResult {
    ShadingMaps maps;
    /// What Lookup::detail is to scale a texel's radiance by: each pixel's albedo under its texel's map, the factor of
    /// S(k, r) / mean albedo that misses the pixel's samples least, drawn towards what all of the texel's samples say
    /// as far as that predicts samples best that are left out. Unlike the unshaded image it knows what the material
    /// does that Lambert's law does not, and that some pixels mostly lie in their neighbours' shadow. Of the given
    /// albedo's validity; where a pixel has no samples it is the given one.
    AlbedoMap albedo;
    double seconds = 0;
};

/// S(k, r) from every photograph and pixel: samples (r = N.L, RGB / irradiance) of each texel, fitted at the levels,
/// between which S is linear; extrapolated by scaling where no sample reaches (thesis, shading maps; Kautz et al.
/// 2004). How samples become levels, and which are shadowed: GainEstimator. Clipped samples are left out. Near lights
/// reach each pixel from a direction and with a fall-off of their own. S(k, 0) = 0. Pixels whose normal or albedo is
/// not a finite number are passed over. Bit-identical on any number of threads. Throws InputError on sizes that differ,
/// and as LightField does.
ShadingResult shading_maps(const PhotoStack& stack, const Lights& lights, const NormalMap& normals,
                           const AlbedoMap& albedo, const IndexMap& index, const ShadingOptions& options = {},
                           const WorkContext& work = {});

}  // namespace darkbox
