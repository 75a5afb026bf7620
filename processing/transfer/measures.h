#pragma once

#include <opencv2/core.hpp>
#include <optional>

#include "acquisition/frame/progress.h"
#include "processing/transfer/appearance.h"
#include "processing/transfer/assignment.h"

namespace darkbox {

struct MeasureOptions {
    int window = 5;       ///< side of the patches, odd, 3...15
    int stride = 4;       ///< target patches are taken from every stride-th row and column, 1...64
    double low_pass = 6;  ///< sigma of the blur under which colours are compared, pixels, 1...64

    /// Throws InputError that names the field and the allowed range.
    void validate() const;
};

/// How good a transferred texture is. Colours are as displayed, in 8-bit units. std::nullopt where there is nothing to
/// measure: no whole patch, no normal that the source knows, or no coordinates.
struct TransferMeasures {
    /// Mean RMS difference of a target patch to the nearest source patch, colours and normals together, and colours
    /// alone; the nearest is exact.
    std::optional<double> joint_energy;
    std::optional<double> patch_energy;
    /// Mean RMS difference, after a blur, to the colour that the source has on average where it faces the same way.
    std::optional<double> colour_error;
    /// Mean over L, a, b (8 bits) of the earth mover's distance of the target's colours to those of source pixels that
    /// face the same ways equally often.
    std::optional<double> histogram_distance;
    /// Mean squared Laplacian over that of the source where it faces the same way: 1 is as sharp as the source.
    std::optional<double> sharpness;

    /// Mean RMS difference of each pixel to the source's own continuation of its neighbour, both ways, over pairs side
    /// by side or one above the other: 0 for a copy.
    std::optional<double> seam;
    std::optional<double> angle_mean_deg;  ///< from a target normal to that of the source pixel it was given
    std::optional<double> angle_p95_deg;
    std::optional<double> coherence;  ///< share of those pairs whose source coordinates lie like they do
    std::optional<double> cover;      ///< share of the source's valid pixels that are used
    std::optional<int> background;    ///< target pixels given a source pixel that is not valid; must be 0
};

/// Of any result given as a picture, `target.picture`.
TransferMeasures measure_picture(const Appearance& source, const Appearance& target, const MeasureOptions& options = {},
                                 const WorkContext& work = {});

/// Of any result given as the source (x, y) of each valid target pixel. Its picture is the source's, read through them.
/// Throws InputError for coordinates that lie outside the source or are not of the target's size.
TransferMeasures measure_coordinates(const Appearance& source, const NormalMap& target, const cv::Mat2i& coordinates,
                                     const MeasureOptions& options = {}, const WorkContext& work = {});

/// TransferMeasures::histogram_distance alone.
std::optional<double> histogram_distance(const Appearance& source, const Appearance& target);

}  // namespace darkbox
