#pragma once

#include <optional>
#include <string>
#include <vector>

#include "acquisition/frame/progress.h"
#include "acquisition/session/session.h"
#include "processing/calibration/calibration.h"
#include "processing/calibration/intensity.h"
#include "processing/maps/maps.h"
#include "processing/maps/view.h"

namespace darkbox {

enum class IntensityChoice {
    automatic,  ///< estimated where nothing is known of them and the photographs clearly ask for it
    given,      ///< as the calibration has them; all equal where it knows nothing
    estimate,   ///< together with the normals, whatever the calibration has
};

/// Intensities read off a diffuse plane while lights are calibrated: the grey card asked for, else frames of kind flat,
/// one per lamp, unless intensities came with the pictures. Changes nothing where there is neither.
Calibration with_measured_intensities(const Session& session, Calibration calibration,
                                      const std::optional<GreyCard>& card, const WorkContext& work);

struct ChosenIntensities {
    Calibration calibration;  ///< its lights with the intensities to use
    bool changed = false;     ///< they were estimated: calibration/lights.json is to hold them from now on
    std::vector<std::string> warnings;
};
/// Estimates intensities from the object's photographs where `choice` says so. `stack` holds every `row_step`-th row of
/// the picture; `geometry` tells where pixels lie, for near lights. Measurements behind the automatic choice:
/// docs/decisions/0013.
ChosenIntensities choose_intensities(const PhotoStack& stack, Calibration calibration, IntensityChoice choice,
                                     const SceneGeometry& geometry, int row_step, const WorkContext& work);

}  // namespace darkbox
