#pragma once

#include <cstdint>
#include <vector>

#include "processing/calibration/calibration.h"
#include "tests/processing/calibration/sphere_scene.h"

namespace darkbox::test {

/// One setting of the simulated sweep over light calibration.
struct SweepSetting {
    double radius_px = 60;
    std::vector<double> full_wells_e{20000};  ///< noise levels: every capture is photographed with each
    std::uint64_t seed = 1;
    int lights = 12;
    enum class Lamps { distant, near_two_balls, near_one_ball } lamps = Lamps::distant;
    bool perspective = false;
    bool wall = true;            ///< behind the balls; else they mirror a room's gradients all around
    double lamp_radiance = 0.9;  ///< above 1: highlights clip
    int captures = 4;            ///< with the ball at another fraction of a pixel and the lamps turned
};

/// How far the calibrated lights were off, over all captures.
struct SweepErrors {
    std::vector<double> raw_deg;      ///< the thesis' method, sorted
    std::vector<double> refined_deg;  ///< sorted
    std::vector<double> chi_squared;  ///< of the refined ones by their covariance, two degrees of freedom, sorted
    int unread = 0;

    double raw_median() const { return raw_deg.empty() ? 0 : raw_deg[raw_deg.size() / 2]; }
    double refined_median() const { return refined_deg.empty() ? 0 : refined_deg[refined_deg.size() / 2]; }
    /// Share of the errors below the point that a chi-squared number of two degrees stays below with `probability`.
    double share_below(double probability) const;
};

/// Renders, photographs with noise, calibrates both ways, compares with the truth at the object. One per noise level.
std::vector<SweepErrors> sweep(const SweepSetting& setting);
/// Adds the errors of one setting to another's.
void gather(SweepErrors& into, const SweepErrors& more);

/// Squared error of a direction in its tangent plane, in units of its covariance.
double chi_squared(const Light& light, const Eigen::Vector3d& truth);

}  // namespace darkbox::test
