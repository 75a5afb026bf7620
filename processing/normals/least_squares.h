#pragma once

#include <cstddef>

#include "processing/maps/maps.h"
#include "processing/normals/light_set.h"

namespace darkbox {

/// What a solver leaves in the maps for one pixel beyond normal and albedo.
struct RowSums {
    double squared_residual = 0;
    std::size_t samples = 0;  ///< behind squared_residual
    std::size_t pixels = 0;   ///< valid ones
    std::size_t not_finite = 0;
};

/// The maps a solver writes row by row. Rows are independent of each other: any number of threads may write them.
struct SolvedMaps {
    explicit SolvedMaps(cv::Size size);

    cv::Mat3f normal;
    cv::Mat3f albedo;
    cv::Mat1b valid;
    cv::Mat1f residual;
    cv::Mat1b lights_used;
};

/// Least squares on one row: g = pinv(L) I from the channel mean, N = g / |g| (Woodham 1980), then albedo per channel
/// over lit samples. Clipped samples are left out of a pixel where the others still determine its normal well.
RowSums solve_row_least_squares(const PhotoStack& stack, const LightSet& set, float min_albedo, int row,
                                SolvedMaps& maps);

}  // namespace darkbox
