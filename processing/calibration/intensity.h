#pragma once

#include <Eigen/Core>
#include <opencv2/core.hpp>
#include <optional>
#include <string>
#include <vector>

#include "processing/calibration/calibration.h"

namespace darkbox {

/// "unknown", "given", "grey card", "flat", "estimated", and back; no value for a name that is not one.
const char* name(IntensityOrigin origin);
std::optional<IntensityOrigin> intensity_origin_from_name(const std::string& name);

/// A diffuse plane in the photographs.
struct GreyCard {
    cv::Rect area;                     ///< pixels of the picture that show nothing else
    std::optional<cv::Mat1b> mask;     ///< of the picture's size, 255 on such pixels; overrides `area`
    Eigen::Vector3d normal{0, 0, 1};   ///< unit, viewer frame
    std::optional<ViewGeometry> view;  ///< needed for near lights: where the card's pixels lie
    double height_mm = 0;              ///< of the card above z = 0, with `view`

    /// Throws InputError that names the field and the allowed range.
    void validate() const;
};

/// Intensity of each light per channel: the card's mean radiance over n.L times the light's fall-off, scaled so that
/// the mean over the used lights is 1 in each channel. `frames`: one per light, linear radiance, R, G, B; `clipped`:
/// 255 where a sample is at full scale. The lights come back with their intensities. Throws InputError in words: a card
/// outside the picture, clipped, unlit, or with a light behind it.
Lights with_intensities_of_card(const std::vector<cv::Mat3f>& frames, const std::vector<cv::Mat1b>& clipped,
                                Lights lights, const GreyCard& card);

/// The mean intensity of the used lights becomes 1 in each channel.
Lights with_mean_intensity_one(Lights lights);

/// The largest over the smallest intensity of the used lights, in the channel where that is largest.
double intensity_spread(const Lights& lights);

/// Says so where lamps differ by more than 1.5 times.
std::optional<std::string> spread_in_words(const Lights& lights);

}  // namespace darkbox
