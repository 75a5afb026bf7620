#pragma once

#include <ceres/problem.h>

#include <array>
#include <vector>

#include "processing/calibration/contour_noise.h"
#include "processing/calibration/refine.h"

namespace darkbox {

/// One ball's observations that are still believed.
struct Believed {
    std::vector<char> point;        ///< 1: the contour point counts
    std::vector<char> highlight;    ///< 1: the frame's highlight counts
    double contour_sigma_px = 0.3;  ///< of a point that tells none of its own
};

enum class Loss { robust, squares };

/// refine()'s least-squares problem, and the parameters in the arrays that Ceres changes. Neither copied nor moved:
/// Ceres keeps addresses. Thread-compatible.
class Adjustment {
public:
    Adjustment(const RefineInput& input, const std::vector<Believed>& believed, Loss loss);
    Adjustment(const Adjustment&) = delete;
    Adjustment& operator=(const Adjustment&) = delete;

    bool solve();

    MirrorSphere sphere(std::size_t ball) const;
    /// Direction or position; no value for a frame without a believed highlight, unless the object tells it.
    std::optional<Eigen::Vector3d> lamp(std::size_t frame) const;
    /// Signed distances of all of a ball's contour points to its outline, pixels.
    std::vector<double> contour_distances_px(std::size_t ball) const;
    /// How far a highlight lies from where the ball mirrors its lamp, pixels.
    std::optional<double> highlight_off_px(std::size_t ball, std::size_t frame) const;
    /// How far the lamp stands from a place in the rig, as the rig's estimated pose has it; of a distant lamp's
    /// direction, at that place. No value for a frame without a believed highlight.
    std::optional<double> off_place_mm(std::size_t frame, const Eigen::Vector3d& place_in_rig_mm) const;
    /// One per frame, of lamp(); zero where it cannot be had.
    std::vector<Eigen::Matrix3d> lamp_covariances();

private:
    struct Shown {
        std::size_t ball, frame;
        ceres::ResidualBlockId residual;
    };
    void add_ball(std::size_t ball, const Believed& believed, Loss loss);
    void add_shifting_contour(std::size_t ball, const Believed& believed, Loss loss);
    void add_lamps(const std::vector<Believed>& believed);
    void add_highlights(std::size_t ball, const Believed& believed, Loss loss);
    void add_nominal(const NominalLamps& nominal);
    void add_object(const LambertSamples& object);

    const RefineInput& input_;
    std::vector<std::array<double, 4>> spheres_;
    std::vector<std::array<double, 3>> shifts_;  ///< of each ball's whole contour, in standard deviations
    std::vector<std::array<double, 3>> lamps_;   ///< one per frame
    std::vector<char> has_lamp_;
    std::vector<double> log_intensities_;  ///< one per frame, with the object's samples alone
    std::array<double, 3> turn_{}, shift_{};
    std::vector<Shown> shown_;
    ceres::Problem problem_;
};

}  // namespace darkbox
