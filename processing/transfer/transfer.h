#pragma once

#include <cstdint>
#include <opencv2/core.hpp>
#include <optional>

#include "acquisition/frame/progress.h"
#include "processing/maps/maps.h"

namespace darkbox {

enum class TransferMethod {
    analogies,   ///< Image Analogies (Hertzmann et al. 2001), refined; as the thesis has it with 0 passes
    patchmatch,  ///< guided PatchMatch, coarse to fine, with a balance of what is used
    preview,     ///< chunks laid over the target by their normals (StyleBlit, Sykora et al. 2019); cuts show
};

struct TransferOptions {
    TransferMethod method = TransferMethod::patchmatch;
    int window = 5;         ///< m: side of the window at the coarsest level and at the current level, odd, 3...15
    int coarse_window = 3;  ///< n: side of the window in the level above, odd, 1...15
    int levels =
        0;  ///< pyramid levels; 0 = as many as keep the shorter side at 32 pixels or more, for patchmatch at most 3
    double kappa = 0.0;           ///< Hertzmann's coherence weight, 0...25; around 2 keeps stones and bricks whole
    double normal_weight = 1.0;   ///< weight of normals against albedo in the feature, 0...100
    double normal_sigma = 1.0;    ///< low-pass of the normals, pixels, 0...64
    double jitter = 1.0;          ///< patchmatch, preview: 0...1, how freely chunks are picked among those that fit
    double control_weight = 1.0;  ///< patchmatch: weight of the control map against albedo, 0...100
    /// Refinement of each level, 0...64; 0 = Image Analogies as the thesis has them, or patchmatch's bare seeds. None:
    /// 7 for patchmatch, 16 for analogies.
    std::optional<int> passes;
    /// analogies: the global match reads every feature of the source in full instead of a short list by principal
    /// components. For testing: time grows with source times target, half an hour of a core at 512 x 512.
    bool exact_search = false;
    std::uint64_t seed = 1;  ///< of all random choices

    /// Throws InputError that names the field and the allowed range.
    void validate() const;
};

struct TransferSource {
    NormalMap normals;
    AlbedoMap albedo;
    IndexMap index;
    /// The albedo that is shown as white where that is known, 1 for a picture; none: appearance.h's white_level.
    std::optional<float> white = {};
};

/// A guide drawn by the user, beside the normals (Lefebvre and Hoppe 2005, section 4): where the target's map has a
/// colour, texture is taken from where the source's map has it. Values of 0...1. Both empty: none.
struct ControlMaps {
    cv::Mat3f source;
    cv::Mat3f target;
};

struct TransferResult {
    cv::Mat2i coordinates;    ///< source (x, y) of each target pixel; (-1, -1) outside
    AlbedoMap albedo;         ///< the source's, read through the coordinates
    IndexMap index;           ///< likewise
    NormalMap normals;        ///< the target's, with the source's fine relief on them
    cv::Mat1f uncovered_deg;  ///< angle from the target's normal to the nearest of the source's, to a degree or so
    double coverage_deg = 0;  ///< 95th percentile of that angle
    double coherence = 0;     ///< share of neighbouring target pixels whose source coordinates are neighbours alike
    /// As TransferMeasures has them; patches of the target on a coarser grid. None where there is nothing to measure.
    std::optional<double> patch_energy;
    std::optional<double> histogram_distance;
    std::optional<double>
        guide_error_deg;  ///< mean angle from a target normal to that of the source pixel it was given
    double seconds = 0;   ///< without the figures
};

/// Texture replacement: source coordinates are synthesised such that normals and texture fit; albedo, index and fine
/// relief are read through them. Only valid source pixels are ever used. Bit-identical on any number of threads.
/// Throws InputError for an empty source or target, for maps that do not fit together or are not finite, and for
/// control maps with another method than patchmatch or an exact search with another than analogies; Cancelled.
TransferResult transfer_texture(const TransferSource& source, const NormalMap& target,
                                const TransferOptions& options = {}, const WorkContext& work = {},
                                const ControlMaps& control = {});

}  // namespace darkbox
