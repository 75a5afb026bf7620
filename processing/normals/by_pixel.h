#pragma once

#include <cstddef>

#include "processing/maps/photo_source.h"
#include "processing/normals/body_law.h"
#include "processing/normals/gloss_law.h"
#include "processing/normals/least_squares.h"
#include "processing/normals/light_field.h"
#include "processing/normals/noise_model.h"
#include "processing/normals/sample_use.h"

namespace darkbox {

/// What the laws of the body and of its gloss and the sensor's noise say about samples; the same for the whole picture.
struct SampleModel {
    BodyLaw law;
    GlossLaw gloss;
    NoiseModel noise;
};

enum class PixelMethod {
    least_squares,  ///< all samples that are not clipped
    robust,         ///< PixelSolver::solve()
};

/// Solves one row of a band pixel by pixel, each with its own lights: for near lights, and for the robust solver.
/// Writes the row band.first_row + row of the maps. Albedo per channel is the least-squares factor of (N.L) f over the
/// samples kept, weighted as they were. Returns how many pixels on the object were left out for a sample that is not a
/// finite number. `uses`, where given, is told the row of every used photograph.
std::size_t solve_row_by_pixel(const PhotoBand& band, const LightField& field, PixelMethod method,
                               const SampleModel& model, float min_albedo, int row, SolvedMaps& maps,
                               SampleUseSink* uses = nullptr);

}  // namespace darkbox
