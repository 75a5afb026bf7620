#pragma once

#include <vector>

#include "processing/normals/pixel_grid.h"

namespace darkbox {

/// A graph of weighted differences, coarser than the picture: every node stands for a patch of pixels. Row-compressed;
/// a node's weights are of differences to other nodes, its diagonal is their sum.
struct CoarseGraph {
    std::vector<int> start, neighbour;
    std::vector<float> weight, inverse_diagonal;  ///< the latter 0 for a node without neighbours
    std::vector<int> block_x, block_y;            ///< where the patch lies, in patches

    std::size_t nodes() const { return block_x.size(); }
};

/// A finer graph's nodes as patches of a coarser one.
struct Aggregation {
    std::vector<int> patch;  ///< by finer node (by index of a picture's grid), -1 where there is none
    CoarseGraph graph;
};

/// Patches of 2x2 pixels, cut where the differences inside are weak against those around: a patch never bridges a
/// discontinuity, so that the coarse graph knows it too (unsmoothed aggregation; Notay 2010, "An aggregation-based
/// algebraic multigrid method", Electronic Transactions on Numerical Analysis 37).
Aggregation aggregate(const PixelGrid& grid, const DifferenceWeights& weights);
Aggregation aggregate(const CoarseGraph& graph);

}  // namespace darkbox
