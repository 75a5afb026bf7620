#pragma once

#include <opencv2/core.hpp>
#include <optional>

#include "acquisition/frame/progress.h"
#include "processing/maps/maps.h"
#include "processing/maps/view.h"

namespace darkbox {

enum class IntegrationMethod {
    bilateral,      ///< every pixel may let go of one neighbour on each axis: depth edges stay sharp
    least_squares,  ///< every pixel holds to all its neighbours (Durou, Queau, Aujol 2018, quadratic formulation)
};

struct IntegrationOptions {
    IntegrationMethod method = IntegrationMethod::bilateral;
    double breaks_at = 0.22;   ///< misfit of height and slope, pixels per pixel, at which the surface starts to give
                               ///< way; never below four standard deviations of the misfits found
    int most_iterations = 60;  ///< of re-weighting, on each level from coarse to fine
    double tolerance = 1e-4;   ///< ends the re-weighting: relative change of the energy
    double cut_below = 0.05;   ///< share of its weight on a smooth surface under which a difference is a depth edge

    /// Throws InputError that names the field and the allowed range.
    void validate() const;
};

struct IntegrationInput {
    NormalMap normals;
    std::optional<ViewGeometry> view = {};  ///< none: orthographic, and heights stay in pixels
    cv::Mat1f confidence = {};  ///< weight of each valid normal, above 0 (1/sigma^2 up to scale); empty: all alike
};

enum class HeightUnit { millimetres, pixels };

inline constexpr unsigned char cut_right = 1, cut_down = 2;

/// A surface seen from the camera.
struct HeightMap {
    cv::Mat1f height;  ///< z in the viewer frame, to the camera; 0 where not valid
    cv::Mat1b valid;
    cv::Mat1b cut;  ///< cut_right: a depth edge to the pixel on the right; cut_down: to the one below
    HeightUnit unit = HeightUnit::pixels;
    int parts = 0;       ///< connected ones; each has mean height 0, since normals say nothing of what lies between
    int iterations = 0;  ///< of re-weighting, on the finest level
    double seconds = 0;
};

/// Height from normals: from every pixel to the next the height rises by the mean of their slopes, -n_x/n_z to the
/// right and n_y/n_z down; no boundary condition is assumed, and masks may have holes and several parts. Bilaterally
/// weighted (Cao, Santo, Shi, Okura, Matsushita 2022, "Bilateral Normal Integration", ECCV): a pixel holds to the side
/// that fits it better, and, beyond the paper, differences that misfit give way; docs/decisions/0018 compares. Solved
/// from coarse to fine. Under a perspective camera the same equations hold for -f log(depth), with n_z replaced by
/// n_z - n_x x/f - n_y y/f (the paper, section 3.2). Pixels steeper than 87 degrees count as that steep. Bit-identical
/// on any number of threads. Throws InputError for an empty map or a confidence that is not positive; Cancelled.
HeightMap integrate_normals(const IntegrationInput& input, const IntegrationOptions& options = {},
                            const WorkContext& work = {});

}  // namespace darkbox
