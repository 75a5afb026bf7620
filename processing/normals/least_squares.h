#pragma once

#include <cstddef>

#include "processing/maps/photo_source.h"
#include "processing/normals/light_set.h"

namespace darkbox {

/// The maps a solver writes row by row. Rows are independent of each other: any number of threads may write them. A
/// solver writes the whole of each row, zeros where there is no result.
struct SolvedMaps {
    /// Not initialised.
    explicit SolvedMaps(cv::Size size);
    /// Memory of one pixel in all maps.
    static std::size_t bytes_per_pixel();

    cv::Mat3f normal;
    cv::Mat3f albedo;
    cv::Mat1b valid;
    cv::Mat1f residual;
    cv::Mat1w lights_used;
    cv::Mat1f sigma_deg;
};

/// Least squares on one row of a band: g = pinv(L) I from the channel mean, N = g / |g| (Woodham 1980), then albedo per
/// channel over lit samples. Clipped samples are left out; where the others do not determine the normal well there is
/// no result. Writes the row band.first_row + row of all maps but sigma_deg. Returns how many pixels on the object were
/// left out for a sample that is not a finite number.
std::size_t solve_row_least_squares(const PhotoBand& band, const LightSet& set, float min_albedo, int row,
                                    SolvedMaps& maps);

}  // namespace darkbox
