#pragma once

#include <cstdint>
#include <opencv2/core.hpp>

#include "processing/transfer/normal_table.h"
#include "processing/transfer/pyramid.h"
#include "processing/transfer/transfer.h"

namespace darkbox {

/// Chunks of the source laid over the target where the normals fit: StyleBlit (Sykora et al. 2019, algorithm 2). Each
/// target pixel asks the seed points of jittered grids, coarse to fine, for the chunk around them, and takes the first
/// whose normal at the pixel is within `threshold` (a distance of unit normals); in the end its own normal's pixel.
struct SeedOptions {
    int largest_chunk = 16;  ///< spacing of the coarsest grid, pixels; a power of two
    float threshold = 0.25F;
    float jitter = 1.0F;  ///< 0 = one source pixel for each normal, 1 = any of those with that normal
    std::uint64_t seed = 1;
};

SeedOptions seed_options(const TransferOptions& options);

/// Source coordinates of every valid target pixel, (-1, -1) elsewhere. Runs on TBB's threads; the result does not
/// depend on their number.
cv::Mat2i seed_coordinates(const MapLevel& source, const NormalTable& table, const MapLevel& target,
                           const SeedOptions& options);

/// Coordinates between levels: the finer pixel continues its parent's patch, and where the source ends there takes the
/// parent's first valid child.
cv::Mat2i refined_coordinates(const cv::Mat2i& coarse, const cv::Mat1b& source, const cv::Mat1b& target);

}  // namespace darkbox
