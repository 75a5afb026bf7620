#pragma once

#include <ceres/cost_function.h>

#include <Eigen/Core>

namespace darkbox {

/// One pixel's kept samples against Lambert's law, in standard deviations; its albedo times normal is eliminated by
/// linear least squares at every evaluation (variable projection, Golub and Pereyra 1973), with the exact Jacobian.
/// Parameter blocks: for each kept frame in order its lamp (direction, or place in mm), then for each the logarithm of
/// its intensity.
class LambertCost : public ceres::CostFunction {
public:
    /// `near`: lamps are places; `point_mm` is where the pixel's surface lies, and irradiance is 1 at `unit_mm`.
    struct Geometry {
        bool near = false;
        Eigen::Vector3d point_mm{0, 0, 0};
        double unit_mm = 1;
    };
    LambertCost(Eigen::VectorXd samples, double sigma, const Geometry& geometry);

    bool Evaluate(double const* const* parameters, double* residuals, double** jacobians) const override;

private:
    Eigen::VectorXd samples_;
    double sigma_;
    Geometry geometry_;
};

}  // namespace darkbox
