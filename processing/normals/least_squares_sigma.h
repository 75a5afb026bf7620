#pragma once

#include <array>

#include "processing/normals/least_squares.h"
#include "processing/normals/light_field.h"
#include "processing/normals/noise_model.h"

namespace darkbox {

/// What predicted_sigma_deg() says, for least squares over all distant lights: there the propagation is a polynomial in
/// g = albedo times normal. Symmetric 3x3 matrices are six numbers: xx, xy, xz, yy, yz, zz.
struct SigmaPolynomial {
    SigmaPolynomial(const LightField& field, const NoiseModel& noise);

    using Symmetric = std::array<float, 6>;

    float lights = 0;
    Symmetric inverse_moments{};       ///< covariance of g for each unit of a sample's variance
    Symmetric dark{};                  ///< covariance of g for g = 0
    std::array<Symmetric, 3> shot{};   ///< for each unit of g
    std::array<Symmetric, 6> lamps{};  ///< for each unit of g's products with itself, off the diagonal once
    float mean_dark = 0;               ///< mean variance of a sample, the same three parts
    std::array<float, 3> mean_shot{};
    Symmetric mean_lamps{};
    bool lamps_known = false;  ///< any of their numbers is not zero
};

/// Writes one row of sigma_deg from the maps' other entries, in vectors (Highway). A pixel's residual has few degrees
/// of freedom: it is pooled with `picture_variance`, the median_variance() of the picture.
void write_sigma_row(const SigmaPolynomial& polynomial, float picture_variance, int row, SolvedMaps& maps);

}  // namespace darkbox
