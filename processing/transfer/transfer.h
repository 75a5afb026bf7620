#pragma once

#include <cstdint>
#include <opencv2/core.hpp>

#include "acquisition/frame/progress.h"
#include "processing/maps/maps.h"

namespace darkbox {

struct TransferOptions {
    int window = 5;               ///< m: side of the window at the coarsest level and at the current level, odd, 3...15
    int coarse_window = 3;        ///< n: side of the window in the level above, odd, 1...15
    int levels = 0;               ///< pyramid levels; 0 = as many as keep the shorter side at 32 pixels or more
    double kappa = 0.0;           ///< Hertzmann's coherence weight, 0...25; around 2 keeps stones and bricks whole
    double normal_weight = 1.0;   ///< weight of normals against albedo in the feature, 0...100
    double normal_sigma = 2.0;    ///< low-pass of the normals, pixels, 0...64
    int passes = 6;               ///< refinement of each level, 0...64; 0 = Image Analogies as the thesis has them
    double evenness = 1.0;        ///< refinement: how evenly the source is to be used, 0...100
    double colour_weight = 0.25;  ///< refinement: weight of the colour that is expected for a normal, 0...100
    std::uint64_t seed = 1;       ///< picks the sample from which the search learns its axes

    /// Throws InputError that names the field and the allowed range.
    void validate() const;
};

struct TransferSource {
    NormalMap normals;
    AlbedoMap albedo;
    IndexMap index;
};

struct TransferResult {
    cv::Mat2i coordinates;    ///< source (x, y) of each target pixel; (-1, -1) outside
    AlbedoMap albedo;         ///< the source's, read through the coordinates
    IndexMap index;           ///< likewise
    double coverage_deg = 0;  ///< 95th percentile of the angle from a target normal to the nearest source normal
    double coherence = 0;     ///< share of neighbouring target pixels whose source coordinates are neighbours alike
    double patch_energy =
        0;  ///< RMS over window x window patches to the nearest source patch, in 8-bit units, on a sampled grid
    double histogram_distance =
        0;  ///< mean quantile distance per channel between target and source albedo, 8-bit units
    double seconds = 0;
};

/// Texture replacement by Image Analogies (Hertzmann et al. 2001) with A = source normals, A' = source albedo, B =
/// target normals (thesis, texture replacement): pyramids, causal windows, approximate nearest neighbours, coherence
/// search (Ashikhmin 2001). Source coordinates are synthesised; albedo and index are read through them. Only valid
/// source pixels are ever used. Bit-identical on any number of threads. Throws InputError for an empty source or
/// target.
TransferResult transfer_texture(const TransferSource& source, const NormalMap& target,
                                const TransferOptions& options = {}, const WorkContext& work = {});

}  // namespace darkbox
