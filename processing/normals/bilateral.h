#pragma once

#include <vector>

#include "processing/normals/slopes.h"

namespace darkbox {

/// The differences between neighbours as the energy sees them, all indexed as the slopes' grid.
struct BilateralEdges {
    explicit BilateralEdges(const PixelGrid& grid);

    DifferenceWeights weights;
    /// How hard each difference pulls its two ends together: weight times (rise - (z_b - z_a)), where the rise is the
    /// mean slope of the two pixels by their confidence, so that smooth surfaces are met to second order.
    std::vector<float> pull_right, pull_down;
    double energy = 0;  ///< sum of weight times squared misfit
};

/// How much each pixel holds to the neighbour on its right and below, 0...1; to those opposite it holds with the rest.
struct Shares {
    explicit Shares(const PixelGrid& grid) : right(grid.size(), 0.5F), down(grid.size(), 0.5F) {}
    std::vector<float> right, down;
};

/// The pixels' shares by the misfit on either side, as in the paper, section 3.1: the side that fits better is held.
void update_shares(const Slopes& slopes, const std::vector<double>& heights, double sharpness, Shares& shares);

/// Weights and pulls at the present heights. A difference is as heavy as its two pixels' shares, confidences and
/// squared cosines to the camera say, and gives way by 1 / (1 + sharpness misfit^2) (Lorentz); 0: it never does.
void update_edges(const Slopes& slopes, const Shares& shares, const std::vector<double>& heights, double sharpness,
                  BilateralEdges& edges);

/// Standard deviation of the present misfits by their median absolute value, pixels; outliers hardly count.
double misfit_scale(const Slopes& slopes, const std::vector<double>& heights);

/// Which differences have less than `share` of the weight that they would have on a smooth surface (cut_right,
/// cut_down), indexed as the grid.
std::vector<unsigned char> cuts_of(const Slopes& slopes, const BilateralEdges& edges, double share);

}  // namespace darkbox
