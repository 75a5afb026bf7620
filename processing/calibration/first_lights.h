#pragma once

#include <optional>
#include <vector>

#include "processing/calibration/refine.h"
#include "processing/calibration/reflect.h"

namespace darkbox {

/// Each frame's lamp as the balls mirror it, ball by ball, before anything is refined.
using RaysToLamps = std::vector<std::vector<Reflection>>;  // [frame], of the balls that show it
RaysToLamps rays_to_lamps(const ViewGeometry& view, const std::vector<BallObservations>& balls, std::size_t frames);

/// The model that LampModel::automatic stands for. `field_mm` is the picture's longer side at the object; no value
/// where the scale is not known. Lamps are near below ten times that: at ten fields' distance the light's direction
/// turns by 5.7 degrees across the picture.
LampModel choose_lamp_model(const RaysToLamps& rays, const std::optional<NominalLamps>& nominal,
                            const std::optional<double>& field_mm);

/// A start for refine(): the mean direction of each frame's rays.
std::vector<Eigen::Vector3d> first_directions(const RaysToLamps& rays);

struct FirstPositions {
    std::vector<Eigen::Vector3d> position_mm;  ///< one per frame
    std::vector<bool> distance_known;          ///< false: the others' median, for want of a second ball
};
/// A start for refine(): where each frame's rays meet, else along the ray as far as the nominal lamp stands, else as
/// far as the other lamps do.
FirstPositions first_positions(const RaysToLamps& rays, const std::optional<NominalLamps>& nominal);

}  // namespace darkbox
