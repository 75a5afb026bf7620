#pragma once

#include "acquisition/frame/progress.h"
#include "processing/maps/maps.h"
#include "processing/maps/view.h"

namespace darkbox {

struct SemiCalibratedOptions {
    double trim = 0.25;       ///< share of a pixel's samples left out at each end: shadows below, highlights above
    int most_pixels = 6000;   ///< of the mask, taken evenly
    int most_rounds = 20;     ///< of choosing samples and solving
    double precision = 1e-4;  ///< relative change of the intensities at which the rounds end
    SceneGeometry geometry;   ///< where the pixels lie: for near lights
    int row_step = 1;         ///< row i of the stack is row i * row_step of the picture that `geometry` speaks of

    /// Throws InputError that names the field and the allowed range.
    void validate() const;
};

struct SemiCalibratedResult {
    Lights lights;  ///< with intensities of mean 1 per channel over the used lights
    double residual_equal =
        0;                ///< RMS of what Lambert's law leaves of the kept samples if all lamps are equal, relative
    double residual = 0;  ///< the same with the estimated intensities
    bool converged = false;
};

/// Lamp intensities together with albedo times normal, from the photographs themselves: I = e_j L_j.g for every pixel,
/// with the directions known. Per channel, the reciprocal intensities are the null vector of the photographs' residual
/// after the best g of every pixel: Cho, Matsushita, Tai and Kweon 2016, "Photometric stereo under non-uniform light
/// intensities and exposures", ECCV, section 3 (linear joint estimation), here with each pixel's darkest and brightest
/// samples left out and the choice repeated; near lights reach each pixel with a direction and a fall-off of its own,
/// which L_j stands for. Relative only: the mean over lamps is 1 in each channel. Needs a curved or
/// many-sided object; shadows and gloss bias it by some percent. Bit-identical on any number of threads.
/// Throws InputError: fewer than four lights, a dark photograph, near lights without a view, an object (such as a
/// plane) that leaves intensities open.
SemiCalibratedResult estimate_intensities(const PhotoStack& stack, const Lights& lights,
                                          const SemiCalibratedOptions& options = {}, const WorkContext& work = {});

}  // namespace darkbox
