#pragma once

#include <Eigen/Core>

#include "processing/normals/least_squares.h"
#include "processing/normals/light_field.h"
#include "processing/normals/noise_model.h"
#include "processing/normals/pixel_solver.h"

namespace darkbox {

// How far a normal may be off: the standard deviation, in degrees, along one axis tangent to the sphere of normals, the
// mean of two axes taken in variance. An angle between normals that are off by a round error of deviation s has
// Rayleigh's distribution: its median is 1.177 s. First-order propagation of three things through the least squares of
// a pixel: the sensor's noise, the directions' covariance of lights where known, and what the pixel's own residual
// shows beyond both. A law that the material does not follow leaves a residual too small to tell how far it bends
// normals: the prediction does not know that error.

/// For a fit with weights, at the pixel whose samples the solver holds.
float predicted_sigma_deg(const PixelFit& fit, const PixelSolver& solver, const LightField& field);

/// The same for least squares over all distant lights, for which the propagation is a polynomial in albedo times
/// normal. Thread-safe once made.
class LeastSquaresSigma {
public:
    LeastSquaresSigma(const LightField& field, const NoiseModel& noise);

    /// Writes one row of sigma_deg from the maps' other entries. A pixel's residual has few degrees of freedom: it is
    /// pooled with `picture_residual`, the picture's median of residuals squared over degrees of freedom.
    void write_row(float picture_variance, int row, SolvedMaps& maps) const;

private:
    using Symmetric = Eigen::Matrix<float, 6, 1>;  ///< xx, xy, xz, yy, yz, zz

    float at(const Eigen::Vector3f& normal, float albedo, float variance, float used) const;

    float lights_ = 0;
    Symmetric inverse_moments_ = Symmetric::Zero();
    Symmetric dark_ = Symmetric::Zero();                                     ///< covariance of g for g = 0
    Eigen::Matrix<float, 6, 3> shot_ = Eigen::Matrix<float, 6, 3>::Zero();   ///< for each unit of g
    Eigen::Matrix<float, 6, 6> lamps_ = Eigen::Matrix<float, 6, 6>::Zero();  ///< for each unit of g's products
    bool lamps_known_ = false;                                               ///< any of them is not zero
    float mean_dark_ = 0;  ///< variance of a sample, the same three parts
    Eigen::Vector3f mean_shot_ = Eigen::Vector3f::Zero();
    Symmetric mean_lamps_ = Symmetric::Zero();
};

/// The median over valid pixels of residual squared over degrees of freedom; 0 where fewer than four lights tell
/// nothing.
float median_variance(const SolvedMaps& maps);

}  // namespace darkbox
