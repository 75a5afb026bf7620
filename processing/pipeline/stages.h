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
#include "processing/formats/ply.h"
#include "processing/normals/photometric_stereo.h"
#include "processing/pipeline/intensities.h"
#include "processing/pipeline/sample_uses.h"
#include "processing/relight/relight.h"
#include "processing/shading/shading.h"
#include "processing/texels/texels.h"

namespace darkbox {

// The stages over a sealed session. Each reads what earlier stages left in the session's folder, writes its own files
// atomically and returns what `--json` shows. A missing artefact is an InputError whose hint is the command to run.

/// Wall time. Where a stage reads while it solves, `solve` is the busy time of all threads with solving over their
/// number, and `read` is what else the pass over the photographs took.
struct StageSeconds {
    double read = 0;
    double solve = 0;
    double write = 0;
};

struct CalibrateOptions {
    CalibrationOptions calibration;
    std::optional<std::filesystem::path> ball_mask;  ///< a picture that is white on the ball or balls
    std::optional<std::filesystem::path> from;  ///< a lights.json, or a session that has one: its lights are reused
    OtherRig other_rig = OtherRig::refuse;      ///< for `from`
    bool photometric = false;                   ///< the object's own diffuse pixels help to refine the lights
    std::optional<GreyCard> grey_card;          ///< in view in the lit frames: tells intensities
    std::optional<std::filesystem::path> grey_card_mask;  ///< a picture that is white on it, instead of its area
};
struct CalibrateSummary {
    Calibration calibration;
    std::vector<std::string> removed;  ///< folders made with the lights of before
    StageSeconds seconds;
    std::optional<double> blur_px = {};  ///< at the ball; see ball_focus.h
};
/// Writes calibration/lights.json, lights.lp, ball.png. What the session knows of the rig's geometry serves where the
/// options leave it open; directions of near lamps hold at the object's centroid (of its mask, which is found without
/// the balls where none is given; else the picture's centre). Intensities are measured where a grey card or flat frames
/// allow. Lights that came with the pictures are taken as they are (method "given") unless a ball is given or `from` is
/// set. Options for reading a ball are refused where none is read. A frame whose lamp the ball does not show is left
/// out with a warning where the photographs were imported, and an error where a rig took them (docs/decisions/0004).
/// Lamps of `from` are found by name; where names do not tell, that is an error, or their places do under
/// OtherRig::compare.
CalibrateSummary run_calibrate(const Session& session, const CalibrateOptions& options = {},
                               const WorkContext& work = {});

struct NormalsOptions {
    PhotometricStereoOptions stereo;
    IntensityChoice intensities = IntensityChoice::automatic;
    bool surface = true;   ///< also integrate the height and write height.exr and surface.ply
    bool shadows = false;  ///< also write results/shadows; the robust solver's alone
};

/// results/height.exr (channel Y: z in the viewer frame) and results/surface.ply.
struct HeightFacts {
    std::string unit;  ///< "mm" where the calibration knows the scale, else "pixels"
    double lowest = 0;
    double highest = 0;
    int parts = 0;  ///< connected ones, each with mean height 0
    MeshCounts mesh;
    double seconds = 0;  ///< of integrating
};

struct NormalsSummary {
    std::string solver;                                           ///< lsq or robust
    std::string body;                                             ///< the law of the material's body that was used
    std::string gloss;                                            ///< the law of its gloss; "none" where none was found
    IntensityOrigin intensity_origin = IntensityOrigin::unknown;  ///< of the lights that were used
    Lights lights;                                                ///< the lights that were used
    std::size_t images = 0;
    std::size_t pixels = 0;                        ///< valid
    double residual_rms = 0;                       ///< linear radiance
    std::optional<double> mean_angular_error_deg;  ///< where truth came with the pictures
    std::optional<HeightFacts> height;             ///< none where the surface was left out
    std::vector<SampleShares> shadows;  ///< of each photograph that was used; empty where they were not asked for
    StageSeconds seconds;
    double intensity_seconds = 0;            ///< of estimating the lamps' intensities
    double megapixel_images_per_second = 0;  ///< of the solver
    std::vector<std::string> warnings;
    std::vector<std::string> removed;  ///< folders made with the normals of before
};
/// Writes results/normals.exr, normals.png, albedo.exr, albedo.png, confidence.exr (lights used, residual, predicted
/// standard deviation in degrees), height.exr, surface.ply, and shadows/ where asked for: a picture for each photograph
/// of what the solver made of its samples (SampleUse). Intensities that are estimated here go into
/// calibration/lights.json, where later stages find them.
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
/// Writes shading/shading_maps.exr, shading.json, albedo.exr (ShadingResult::albedo).
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

/// What transfer needs, from the session's results: its albedo is the unshaded image.
RelightScene load_scene(const Session& session);
/// What relight needs: the same, but its albedo is that under the shading maps (ShadingResult::albedo).
RelightScene load_shaded_scene(const Session& session);
/// Where the object's surface lies, for near lamps: the scene's `geometry`. Throws InputError where the session does
/// not know the scale of its pictures.
SceneGeometry load_geometry(const Session& session);
/// What calibration/lights.json holds.
Calibration load_calibration(const Session& session);
/// Its lights.
Lights load_lights(const Session& session);

}  // namespace darkbox
