#pragma once

#include <optional>

#include "acquisition/frame/progress.h"
#include "processing/maps/photo_source.h"
#include "processing/normals/by_pixel.h"
#include "processing/normals/light_field.h"

namespace darkbox {

/// What is known beforehand; the rest is found from the photographs.
struct GivenModel {
    std::optional<BodyLaw> law;
    std::optional<NoiseModel> noise;
};

/// Finds noise and body law from pairs of neighbouring pixels on a regular grid over the picture, whatever the bands'
/// height and the number of threads. Reads the photographs once from the top to the bottom, and rewinds them.
///
/// Noise: each pixel is fitted, and the residuals under one light of two neighbours are subtracted. What no law
/// explains in shading and texture is nearly the same for both and drops out; the noise stays. The variance of these
/// differences is taken in eight classes of radiance by the median of absolute values, and a straight line through the
/// classes gives read noise and shot gain. Cameras whose neighbouring samples share noise (after demosaicing) look
/// better than they are.
///
/// Laws of body and gloss: find_surface_law() on at most a thousand of these pixels. With fewer than seven lights, and
/// while near lights fall on a surface whose height is not known yet (a law would be bent to explain that), Lambert's
/// law without gloss is kept; a given body law comes without gloss.
SampleModel find_sample_model(PhotoSource& photos, const LightField& field, const GivenModel& given, int band_rows,
                              const WorkContext& work);

}  // namespace darkbox
