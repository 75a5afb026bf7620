#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "acquisition/frame/progress.h"
#include "acquisition/session/session.h"
#include "processing/calibration/calibration.h"
#include "processing/calibration/drift.h"
#include "processing/calibration/intensity.h"
#include "processing/normals/photometric_stereo.h"
#include "processing/pipeline/intensities.h"
#include "processing/relight/relight.h"
#include "processing/shading/shading.h"
#include "processing/texels/texels.h"

namespace darkbox {

// The stages over a sealed session. Each reads what earlier stages left in the session's folder, writes its own files
// atomically and returns what `--json` shows. A missing artefact is an InputError whose hint is the command to run.

struct StageSeconds {
    double read = 0;
    double solve = 0;
    double write = 0;
};

struct CalibrateOptions {
    CalibrationOptions calibration;
    std::optional<std::filesystem::path> from;  ///< a lights.json, or a session that has one: its lights are reused
    std::optional<GreyCard> grey_card;          ///< in view in the lit frames: tells intensities
    std::optional<RigLights> described;         ///< where the rig's description has the lamps; for warnings
};
struct CalibrateSummary {
    Calibration calibration;
    StageSeconds seconds;
};
/// Writes calibration/lights.json, lights.lp, ball.png. Intensities are measured where a grey card or flat frames
/// allow. Lights that came with the pictures are taken as they are (method "given") unless a ball is given or `from` is
/// set.
CalibrateSummary run_calibrate(const Session& session, const CalibrateOptions& options = {},
                               const WorkContext& work = {});

/// The solver's own options, and what the stage decides before it.
struct NormalsOptions : PhotometricStereoOptions {
    IntensityChoice intensities = IntensityChoice::automatic;
};
struct NormalsSummary {
    std::string solver;
    IntensityOrigin intensity_origin = IntensityOrigin::unknown;  ///< of the lights that were used
    Lights lights;                                                ///< the lights that were used
    std::size_t images = 0;
    std::size_t pixels = 0;                        ///< valid
    double residual_rms = 0;                       ///< linear radiance
    std::optional<double> mean_angular_error_deg;  ///< where truth came with the pictures
    StageSeconds seconds;
    double megapixel_images_per_second = 0;  ///< of the solver
    std::vector<std::string> warnings;
};
/// Writes results/normals.exr, normals.png, albedo.exr, albedo.png, confidence.exr (lights used, residual), height.exr,
/// surface.ply. Intensities that are estimated here go into calibration/lights.json, where later stages find them.
NormalsSummary run_normals(const Session& session, const NormalsOptions& options = {}, const WorkContext& work = {});

struct TexelsSummary {
    int texels = 0;
    double within_cluster_variance = 0;
    double variance_explained = 0;
    StageSeconds seconds;
};
/// Writes texels/index.png, texels.json.
TexelsSummary run_texels(const Session& session, const TexelOptions& options = {}, const WorkContext& work = {});

struct ShadeSummary {
    int texels = 0;
    int levels = 0;
    std::size_t samples = 0;
    StageSeconds seconds;
};
/// Writes shading/shading_maps.exr, shading.json.
ShadeSummary run_shade(const Session& session, const ShadingOptions& options = {}, const WorkContext& work = {});

struct ReportSummary {
    std::filesystem::path file;
    std::vector<std::filesystem::path> relit;
    std::vector<std::string> warnings;
    double seconds = 0;
};
/// Writes results/relit-*.png under a few default lights, and report.html. Parts whose stage has not run are left out.
ReportSummary run_report(const Session& session, const WorkContext& work = {});

struct ProcessOptions {
    CalibrateOptions calibrate;
    NormalsOptions normals;
    TexelOptions texels;
    ShadingOptions shading;
};
struct ProcessSummary {
    CalibrateSummary calibrate;
    NormalsSummary normals;
    TexelsSummary texels;
    ShadeSummary shade;
    ReportSummary report;
};
/// All stages in order, then the report.
ProcessSummary run_process(const Session& session, const ProcessOptions& options = {}, const WorkContext& work = {});

/// What relight and transfer need, from the session's results.
RelightScene load_scene(const Session& session);
/// The lights of calibration/lights.json.
Lights load_lights(const Session& session);

}  // namespace darkbox
