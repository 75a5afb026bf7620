#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "acquisition/frame/progress.h"
#include "processing/calibration/light_geometry.h"

namespace darkbox {

/// What a plan takes an attached shadow for.
enum class PlanShadows {
    automatic,  ///< `ignored` for three lamps, none of which can be spared; `respected` for more
    respected,  ///< a lamp below a normal's horizon says nothing about it
    ignored,    ///< every lamp lights every normal: shallow reliefs, and the theory's setting
};

struct RigPlanOptions {
    int lamps = 12;
    double distance_mm = 1000;                 ///< of every lamp from the object
    double min_elevation_deg = 20;             ///< above the object's plane, which faces the camera
    double max_elevation_deg = 80;             ///< leaves room for the camera at 90 degrees
    std::optional<double> min_separation_deg;  ///< between lamps; none: half of what even spacing would give
    PlanShadows shadows = PlanShadows::automatic;

    /// Throws InputError that names the field and the allowed range.
    void validate() const;
};

struct RigPlan {
    std::vector<Eigen::Vector3d> positions_mm;  ///< rig frame: x right, y up, z to the camera, origin at the object
    double predicted_error_deg = 0;  ///< mean over visible normals per 1 % of noise, at most a radian each: minimised
    double ring_error_deg = 0;       ///< the same for as many lamps on one ring, 45 degrees up or as near as allowed
    LightGeometry geometry;          ///< of the plan
    LightGeometry ring_geometry;
    PlanShadows shadows = PlanShadows::respected;  ///< `respected` or `ignored`
};

/// Lamp positions that minimise the predicted error of normals. With shadows ignored that is the criterion of Drbohlav
/// and Chantler 2005 (ICCV, "On optimal light configurations in photometric stereo"), whose optimum for three lamps is
/// an orthogonal triad, 54.7 degrees off the view axis. Descent lamp by lamp from an even spiral and from a ring; no
/// random numbers, bit-identical on any number of threads. Throws InputError when so many lamps, that far apart, do not
/// fit between the limits.
RigPlan plan_rig(const RigPlanOptions& options = {}, const WorkContext& work = {});

}  // namespace darkbox
