#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "acquisition/frame/progress.h"
#include "processing/maps/maps.h"
#include "processing/normals/photometric_stereo.h"
#include "processing/pipeline/predictors.h"

namespace darkbox {

// Leave one light out: everything is fitted again without one photograph, the photograph is predicted from its light,
// and compared with the real one. It needs no truth, so that it tells of real captures what angular errors cannot.

/// Every pixel of the object, and three kinds of them apart.
enum class PixelKind {
    all,
    lit,        ///< neither of the others
    shadowed,   ///< faces away from the light, or sends less than half of what Lambert expects
    highlight,  ///< clipped, or sends more than Lambert expects by a fifth of its albedo
};
inline constexpr std::array<PixelKind, 4> pixel_kinds{PixelKind::all, PixelKind::lit, PixelKind::shadowed,
                                                      PixelKind::highlight};
const char* name(PixelKind kind);

struct PredictionError {
    double rmse_relative = 0;  ///< over pixels and channels, relative to the photograph's mean over all of the object
    double psnr_db = 0;        ///< against full scale, 1.0
    std::size_t pixels = 0;
};

/// One predictor's errors, in the order of pixel_kinds; no value where there are no such pixels.
using PredictionErrors = std::array<std::optional<PredictionError>, pixel_kinds.size()>;

struct HeldOutLight {
    std::string file;
    bool hull = false;  ///< outside the convex hull of the other lights' directions: predicting it extrapolates
    std::vector<PredictionErrors> errors;  ///< one per predictor, in their order; empty: the others do not suffice
    double normal_change_deg = 0;          ///< mean angle between the normals with and without this photograph
};

/// How the lamps' intensities are known.
enum class HeldOutIntensities {
    given,      ///< from elsewhere than these photographs
    estimated,  ///< from these photographs: to be estimated again without the one that is left out
};

/// Pixels are compared where `reference`, a fit to all photographs, is valid; it also says which are lit, shadowed or
/// highlights, so that the kinds are the same whatever is compared. A pixel that the refit cannot solve is predicted
/// black. The held-out light's own direction and intensity are given, as predicting its photograph needs them; of an
/// estimated intensity, that is its ratio to the other lights'. Where the photograph is clipped a brighter prediction
/// is no error. Lights that are not used are passed over; a light without which the others have no unique solution, or
/// leave their intensities open, gets no errors. Throws InputError as photometric_stereo() does, and for fewer than
/// four used lights.
std::vector<HeldOutLight> leave_one_light_out(const PhotoStack& stack, const Lights& lights,
                                              const PhotometricStereoResult& reference,
                                              const std::vector<Predictor>& predictors,
                                              const PhotometricStereoOptions& options = {},
                                              HeldOutIntensities intensities = HeldOutIntensities::given,
                                              const WorkContext& work = {});

/// Lights whose photographs are predicted between others, beyond them, or both.
enum class LightGroup { every, interior, hull };
struct MeanErrors {
    PredictionErrors errors;                                    ///< their pixels: the sum
    std::array<std::size_t, pixel_kinds.size()> photographs{};  ///< behind each
};
/// One predictor's errors averaged over those of a group's photographs that every predictor can predict, so that the
/// means of all predictors are of the same photographs.
MeanErrors mean_errors(const std::vector<HeldOutLight>& lights, std::size_t predictor, LightGroup group);

/// For each used light whether it is outside or on the border of the convex hull of all used ones, seen as points of
/// the plane across their mean direction (gnomonic projection); true for those 90 degrees or more off that mean.
std::vector<bool> on_hull(const Lights& lights);

}  // namespace darkbox
