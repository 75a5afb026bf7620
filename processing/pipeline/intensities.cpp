#include "processing/pipeline/intensities.h"

#include <fmt/format.h>

#include <algorithm>

#include "acquisition/frame/error.h"
#include "processing/calibration/card_intensity.h"
#include "processing/calibration/lamp_checks.h"
#include "processing/normals/semi_calibrated.h"
#include "processing/pipeline/radiance.h"
#include "processing/pipeline/session_files.h"
#include "processing/pipeline/steps.h"

namespace darkbox {
namespace {

constexpr std::size_t fewest_for_automatic = 6;  // lights: fewer leave too little to tell intensities from shape
constexpr double clear_gain = 0.7;               // of the residual with equal lamps

std::size_t used_lights(const Lights& lights) {
    return static_cast<std::size_t>(
        std::count_if(lights.begin(), lights.end(), [](const Light& light) { return light.used; }));
}

/// The middle of the picture, where a flat field shows its plane.
GreyCard middle_of(cv::Size size) {
    GreyCard card;
    card.area = {size.width / 4, size.height / 4, std::max(1, size.width / 2), std::max(1, size.height / 2)};
    return card;
}

SemiCalibratedResult estimated_from(const PhotoStack& stack, Lights lights, const SemiCalibratedOptions& options,
                                    const WorkContext& work) {
    for (Light& light : lights) light.intensity.setOnes();
    return estimate_intensities(stack, lights, options, work);
}

/// None where the photographs leave intensities open: nobody asked for them.
std::optional<SemiCalibratedResult> tried_on(const PhotoStack& stack, const Lights& lights,
                                             const SemiCalibratedOptions& options, const WorkContext& work) {
    try {
        return estimated_from(stack, lights, options, work);
    } catch (const InputError&) {
        return std::nullopt;
    }
}

std::string in_words(const SemiCalibratedResult& result, const std::string& spread) {
    return fmt::format(
        "{}; their intensities were estimated together with the normals: what Lambert's law leaves "
        "unexplained fell from {:.1f} % to {:.1f} %",
        spread, 100 * result.residual_equal, 100 * result.residual);
}

ChosenIntensities adopted(Calibration calibration, SemiCalibratedResult result) {
    ChosenIntensities chosen{std::move(calibration), true, {}};
    if (const auto spread = spread_in_words(result.lights)) chosen.warnings.push_back(in_words(result, *spread));
    chosen.calibration.lights = std::move(result.lights);
    chosen.calibration.intensity_origin = IntensityOrigin::estimated;
    return chosen;
}

}  // namespace

Calibration with_measured_intensities(const Session& session, Calibration calibration,
                                      const std::optional<GreyCard>& card, const WorkContext& work) {
    const bool flats = photographs_of(session, FrameKind::flat).size() == calibration.lights.size();
    if (!card && (!flats || calibration.intensity_origin != IntensityOrigin::unknown)) return calibration;
    const std::vector<FrameRecord> frames = photographs_of(session, card ? FrameKind::lit : FrameKind::flat);
    if (frames.size() != calibration.lights.size())
        throw InputError(
            fmt::format("{} frames of the grey card for {} lights", frames.size(), calibration.lights.size()),
            "give one frame for each light");
    for_radiances(session, frames, work, [&](std::size_t i, const Radiance& frame) {
        Light& light = calibration.lights[i];
        GreyCard area = card ? *card : middle_of(frame.image.size());
        area.view = calibration.view;
        if (light.used) light.intensity = intensity_on_card(frame.image, frame.clipped, light, area);
    });
    calibration.lights = with_mean_intensity_one(std::move(calibration.lights));
    calibration.intensity_origin = card ? IntensityOrigin::grey_card : IntensityOrigin::flat;
    for (std::string& words : weak_lamps(calibration.lights)) calibration.warnings.push_back(std::move(words));
    return calibration;
}

ChosenIntensities choose_intensities(const PhotoStack& stack, Calibration calibration, IntensityChoice choice,
                                     const SceneGeometry& geometry, int row_step, const WorkContext& work) {
    const bool known = calibration.intensity_origin != IntensityOrigin::unknown;
    const bool few = used_lights(calibration.lights) < fewest_for_automatic;
    if (choice == IntensityChoice::given || (choice == IntensityChoice::automatic && (known || few)))
        return {std::move(calibration), false, {}};
    step(work, {"estimating intensities", 0, 1, ""});
    SemiCalibratedOptions options;
    options.geometry = geometry;
    options.row_step = row_step;
    if (choice == IntensityChoice::estimate) {
        SemiCalibratedResult result = estimated_from(stack, calibration.lights, options, work);
        return adopted(std::move(calibration), std::move(result));
    }
    auto result = tried_on(stack, calibration.lights, options, work);
    if (!result || !(result->residual < clear_gain * result->residual_equal))
        return {std::move(calibration), false, {}};
    return adopted(std::move(calibration), std::move(*result));
}

}  // namespace darkbox
