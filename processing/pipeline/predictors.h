#pragma once

#include <functional>
#include <opencv2/core.hpp>
#include <optional>
#include <string>
#include <vector>

#include "acquisition/frame/progress.h"
#include "processing/maps/maps.h"
#include "processing/normals/photometric_stereo.h"
#include "processing/relight/relight.h"

namespace darkbox {

// Ways to draw a photograph that was not seen from those that were: what darkbox does, and what it has to beat.

/// What a predictor may learn from.
struct HeldOutTraining {
    const PhotoStack& stack;                ///< the held-out photograph is in it, but its light is not `used`
    const Lights& lights;                   ///< `used` is false for the held-out one
    const PhotometricStereoResult& solved;  ///< fitted to the used ones
    const RelightScene& scene;              ///< as darkbox relights it: with texels and shading maps of the used ones
    const SceneGeometry& geometry;          ///< for near lights
};

/// Draws the held-out photograph under `light`: linear radiance, of the stack's size; no value where the used lights do
/// not suffice for its model. Names as `--json` shows them.
struct Predictor {
    std::string name;
    std::function<std::optional<cv::Mat3f>(const HeldOutTraining& training, const Light& light,
                                           const WorkContext& work)>
        predict;
};

/// "lambert": albedo times max(0, N.L) times the light's intensity, of a near light as it arrives at the pixel.
Predictor lambert_predictor();
/// "darkbox_thesis" or "darkbox_detail": the object relit from its shading maps, by a near lamp as it arrives at the
/// pixel.
Predictor darkbox_predictor(Lookup lookup);
/// "ptm": a polynomial texture map of the photographs, one polynomial per channel; it takes every light for distant.
/// None below six lights, or where their terms are not independent.
Predictor ptm_predictor();
/// All of them, darkbox's first.
std::vector<Predictor> every_predictor();

/// N.L of each valid pixel, of a near light times its fall-off there; 0 where not valid.
cv::Mat1d lambert_shading(const Light& light, const NormalMap& normals, const SceneGeometry& geometry);

}  // namespace darkbox
