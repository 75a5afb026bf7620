#pragma once

#include <Eigen/Core>
#include <limits>
#include <optional>
#include <vector>

#include "processing/calibration/calibration.h"
#include "processing/calibration/photometric.h"

namespace darkbox {

/// One ball as measured, and what the joint adjustment starts from.
struct BallObservations {
    MirrorSphere sphere;  ///< the start
    std::vector<cv::Point2d> contour;
    double depth_sigma_mm = 1e4;   ///< how firmly the start's z is believed
    double radius_sigma_mm = 1e4;  ///< and its radius
    std::optional<Ball> outline;   ///< believed beforehand, such as a circle drawn by hand
    double outline_sigma_px = 0.5;
    std::vector<double> contour_sigma_px;  ///< of each contour point; empty: as their scatter tells
    /// By which the whole contour may be off, as a circle (x, y, radius; px^2); none: as the scatter tells.
    std::optional<Eigen::Matrix3d> shift_covariance;
    std::vector<std::optional<Highlight>> highlights;  ///< one per frame
};

struct RefineInput {
    ViewGeometry view;  ///< of 1 mm per pixel where the scale is not known
    std::vector<BallObservations> balls;
    LampModel lamps = LampModel::distant;  ///< distant or near
    std::vector<Eigen::Vector3d> start;    ///< one per frame: a direction, or a position in mm
    std::vector<bool> distance_known;      ///< near: one per frame; false: only about what `start` says
    Eigen::Vector3d object_mm{0, 0, 0};    ///< where a near lamp's direction is to hold
    std::optional<NominalLamps> nominal;
    LambertSamples object;  ///< empty: only the balls speak
};

struct RefinedLight {
    Eigen::Vector3d direction{0, 0, 1};
    Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();  ///< rad^2, rank two
    std::optional<LampPosition> near;                      ///< of a near lamp
};

/// A highlight that does not fit the others.
struct RejectedHighlight {
    std::size_t ball = 0;
    std::size_t frame = 0;
    double off_px = 0;
};

/// A lamp that does not stand where the rig's description has it.
struct MisplacedLamp {
    std::size_t frame = 0;
    double off_mm = 0;
};

/// What became of one ball.
struct RefinedBall {
    MirrorSphere sphere;
    double contour_rms_px = 0;  ///< of the points kept
    std::size_t rejected_points = 0;
    double worst_rejected_px = 0;
    double readings_per_independent = 1;  ///< how many neighbouring contour points say the same
};

struct RefineResult {
    std::vector<RefinedBall> balls;
    std::vector<std::optional<RefinedLight>> lights;  ///< one per frame; none where no highlight is left
    std::vector<RejectedHighlight> rejected;
    std::vector<MisplacedLamp> misplaced;
    bool converged = false;
};

/// Spheres and lights together (Ceres, one thread): every contour point lies on its ball's outline, every highlight
/// where the ball mirrors its lamp, the lamps about where the rig's description says, and the object's samples follow
/// Lambert's law. First with Cauchy's loss; what
/// then lies off by more than four standard deviations is left out, the contour's own scatter and the likeness of
/// neighbouring points are taken from what remains, and plain least squares on that gives values and covariances: they
/// hold the balls' uncertainty as well as the highlights'. Where a frame's highlights and the rig's description
/// contradict each other, the highlights are believed and the description of that lamp is left out.
/// Throws InputError when a highlight lies off its ball.
RefineResult refine(const RefineInput& input);

}  // namespace darkbox
