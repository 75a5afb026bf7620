#pragma once

#include <Eigen/Core>
#include <cmath>
#include <optional>
#include <vector>

#include "processing/calibration/calibration.h"
#include "processing/calibration/circle_fit.h"

namespace darkbox {

/// What the joint adjustment starts from.
struct RefineInput {
    Circle circle;
    std::vector<cv::Point2d> contour;
    double contour_sigma_px = 0.3;  ///< of one contour point, across the outline
    double circle_sigma_px = 1e3;   ///< how firmly `circle` itself is believed, in each of x, y and radius
    std::vector<std::optional<Highlight>> highlights;  ///< one per frame
};

struct RefinedLight {
    Eigen::Vector3d direction{0, 0, 1};
    Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();  ///< rad^2, rank two
};

struct RefineResult {
    Circle circle;
    std::vector<std::optional<RefinedLight>> lights;  ///< one per frame; none where there was no highlight
    double contour_rms_px = 0;
    bool converged = false;
};

/// Circle and light directions together (Ceres, one thread): every contour point lies on the circle, every highlight
/// where its light is mirrored. Contour residuals carry a Cauchy loss. The directions' standard deviations hold the
/// circle's uncertainty as well as the highlights'.
/// Throws InputError when a highlight lies off the circle.
RefineResult refine(const RefineInput& input);

/// Residual of a contour point: its distance to the circle (x, y, radius) over sigma.
struct ContourResidual {
    double u, v, sigma_px;

    template <class T>
    bool operator()(const T* circle, T* residual) const {
        using std::sqrt;
        const T dx = u - circle[0], dy = v - circle[1];
        residual[0] = (sqrt(dx * dx + dy * dy) - circle[2]) / sigma_px;
        return true;
    }
};

/// Residual of a highlight: c + r n_xy - (u, v) over sigma, with n halfway between the light and V = (0, 0, 1).
struct HighlightResidual {
    double u, v, sigma_px;

    template <class T>
    bool operator()(const T* circle, const T* light, T* residual) const {
        using std::sqrt;
        const T z = light[2] + 1.0;
        const T length = sqrt(light[0] * light[0] + light[1] * light[1] + z * z);
        residual[0] = (circle[0] + circle[2] * light[0] / length - u) / sigma_px;
        residual[1] = (circle[1] - circle[2] * light[1] / length - v) / sigma_px;  // v runs down, y up
        return true;
    }
};

}  // namespace darkbox
