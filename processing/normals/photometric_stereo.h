#pragma once

#include <opencv2/core.hpp>
#include <string>

#include "acquisition/frame/progress.h"
#include "processing/maps/maps.h"
#include "processing/maps/photo_source.h"
#include "processing/normals/light_field.h"
#include "processing/normals/sample_model.h"
#include "processing/normals/sample_use.h"

namespace darkbox {

enum class Solver {
    lsq,     ///< least squares over all samples that are not clipped; no result where these do not determine a normal
    robust,  ///< leaves out shadows and highlights per pixel: PixelSolver; its model: find_sample_model()
};

struct PhotometricStereoOptions {
    Solver solver = Solver::lsq;
    GivenModel model;          ///< noise and, for the robust solver, body law; what is not given is found
    SceneGeometry geometry;    ///< for near lights and near cameras
    float min_albedo = 1e-4F;  ///< pixels with a smaller mean albedo are not valid (1.0 = full scale)
    /// Memory for photographs' samples and the maps made from them, MiB. The maps are held whole (about 35 bytes a
    /// pixel, 4 more where the mask is to be found); what remains bounds the height of the two bands in memory. It does
    /// not change results.
    int memory_mib = 2048;
    int band_rows = 0;              ///< rows of a band; 0: as memory_mib allows. It does not change results.
    SampleUseSink* uses = nullptr;  ///< is told of every sample; the robust solver's alone

    /// Throws InputError that names the field and the allowed range.
    void validate() const;
};

struct PhotometricStereoResult {
    NormalMap normals;
    AlbedoMap albedo;
    cv::Mat1f residual;          ///< RMS over lights of (I - rho N.L), linear radiance
    cv::Mat1w lights_used;       ///< photographs behind each pixel
    cv::Mat1f sigma_deg;         ///< predicted standard deviation of the normal per tangent axis: predicted_sigma.h
    SampleModel model;           ///< that the solver worked with; least squares: Lambert, the noise only if given
    double residual_rms = 0;     ///< over all valid pixels
    std::size_t pixels = 0;      ///< valid ones
    std::size_t not_finite = 0;  ///< pixels of the mask left out for a sample that is not a finite number
    double seconds = 0;          ///< of solving alone: busy time of all threads over their number
};

/// Least squares on I = rho N.L over all used lights (Woodham 1980, Optical Engineering 19(1); thesis, photometric
/// stereo), or its robust relative. Normals from the channel mean; albedo per channel as the least-squares factor of
/// N.L, given the normal, over lit samples. Each photograph is divided by its light's intensity; near lights reach each
/// pixel from a direction and with a fall-off of its own. Normals are in the viewer frame, the camera near or not.
///
/// Works by bands of rows: while one band is solved the next is read; the robust solver reads everything once more
/// before, for its model. Bit-identical on any number of threads and for
/// any height of the bands. Throws InputError as the source and require_solvable() do, when lights and photographs
/// differ in number, and when memory_mib holds not even two rows.
PhotometricStereoResult photometric_stereo(PhotoSource& photos, const Lights& lights,
                                           const PhotometricStereoOptions& options = {}, const WorkContext& work = {});
/// The same for photographs in memory.
PhotometricStereoResult photometric_stereo(const PhotoStack& stack, const Lights& lights,
                                           const PhotometricStereoOptions& options = {}, const WorkContext& work = {});

}  // namespace darkbox
