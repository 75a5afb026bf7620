#pragma once

#include <vector>

#include "processing/normals/body_law.h"
#include "processing/normals/gloss_law.h"
#include "processing/normals/pixel_solver.h"

namespace darkbox {

/// How a surface returns light: its body, and the gloss above it.
struct SurfaceLaw {
    BodyLaw body;
    GlossLaw gloss;
};

/// The law whose fits leave the smallest misfit in the median over pixels, each relative to that of the law known so
/// far, Lambert's at first. Looked for in turn: the body's law; a lobe, first over octaves of exponent and strength,
/// then about the best of these; the body's law again where there is a lobe. Each must beat what is known by 3 %.
SurfaceLaw find_surface_law(const std::vector<PixelSamples>& pixels);

}  // namespace darkbox
