#pragma once

#include <opencv2/core.hpp>
#include <string>

#include "acquisition/frame/progress.h"
#include "processing/maps/maps.h"

namespace darkbox {

enum class Solver { lsq };

struct PhotometricStereoOptions {
    Solver solver = Solver::lsq;
    float min_albedo = 1e-4F;  ///< pixels with a smaller mean albedo are not valid (1.0 = full scale)

    /// Throws InputError that names the field and the allowed range.
    void validate() const;
};

struct PhotometricStereoResult {
    NormalMap normals;
    AlbedoMap albedo;
    cv::Mat1f residual;          ///< RMS over lights of (I - rho N.L), linear radiance
    cv::Mat1b lights_used;       ///< photographs behind each pixel
    double residual_rms = 0;     ///< over all valid pixels
    std::size_t pixels = 0;      ///< valid ones
    std::size_t not_finite = 0;  ///< pixels of the mask left out for a sample that is not a finite number
    double seconds = 0;          ///< of solving
};

/// Least squares on I = rho N.L over all used lights (Woodham 1980, Optical Engineering 19(1); thesis, photometric
/// stereo). Normals from the channel mean; albedo per channel as the least-squares factor of N.L, given the normal,
/// over lit samples. Each photograph is divided by its light's intensity. Bit-identical on any number of threads.
/// Throws InputError as require_consistent() and require_solvable() do.
PhotometricStereoResult photometric_stereo(const PhotoStack& stack, const Lights& lights,
                                           const PhotometricStereoOptions& options = {}, const WorkContext& work = {});

}  // namespace darkbox
