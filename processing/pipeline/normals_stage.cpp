#include <tbb/parallel_invoke.h>

#include <algorithm>

#include "processing/formats/calibration_file.h"
#include "processing/formats/exr.h"
#include "processing/formats/json_file.h"
#include "processing/formats/map_files.h"
#include "processing/formats/ply.h"
#include "processing/maps/parallel.h"
#include "processing/maps/srgb.h"
#include "processing/normals/integrate.h"
#include "processing/normals/solver_names.h"
#include "processing/pipeline/angular_error.h"
#include "processing/pipeline/frame_tally.h"
#include "processing/pipeline/session_files.h"
#include "processing/pipeline/solved.h"
#include "processing/pipeline/stack.h"
#include "processing/pipeline/stages.h"
#include "processing/pipeline/steps.h"
#include "processing/pipeline/summary_json.h"
#include "processing/pipeline/transfer_check.h"

namespace darkbox {
namespace {

constexpr int near_light_passes = 2;  ///< more change nothing that can be seen

/// Truth of another size, or of nothing that was solved, is for evaluate to refuse: the normals are good without it.
std::optional<double> error_against_truth(const Session& session, const NormalMap& normals) {
    const auto file = extra_of(session, given_truth);
    if (!file) return std::nullopt;
    const NormalMap truth = read_normal_truth(*file);
    if (truth.normal.size() != normals.normal.size() || cv::countNonZero(truth.valid & normals.valid) == 0)
        return std::nullopt;
    return angular_error(normals, truth).mean_deg;
}

/// The curve of 8-bit imports: the one choice that the pictures themselves can contradict.
std::optional<TransferCurve> doubtful_curve(const Session& session) {
    const auto lit = frames_of_kind(session, FrameKind::lit);
    const bool doubtful = session.info().source == "import" && !lit.empty() &&
                          std::all_of(lit.begin(), lit.end(), [&](const FrameRecord& frame) {
                              return frame.bit_depth == 8 && frame.transfer == lit.front().transfer;
                          });
    return doubtful ? std::optional(lit.front().transfer) : std::nullopt;
}

HeightFacts facts_of(const HeightMap& map, const MeshCounts& mesh) {
    HeightFacts facts{map.unit == HeightUnit::millimetres ? "mm" : "pixels", 0, 0, map.parts, mesh, map.seconds};
    cv::minMaxLoc(map.height, &facts.lowest, &facts.highest, nullptr, nullptr, map.valid);
    return facts;
}

HeightFacts write_surface(const ResultFiles& files, const PhotometricStereoResult& solved,
                          const std::optional<ViewGeometry>& view, const WorkContext& work) {
    step(work, {"integrating height", 0, 1, ""});
    const HeightMap height = integrate_normals({solved.normals, view}, {}, work);
    write_exr(files.height, height.height);
    return facts_of(height, write_ply(files.surface, height, solved.normals, solved.albedo, view));
}

/// Near lights and near cameras need to know where each pixel lies: first in the plane z = 0, then on the surface that
/// the last normals gave.
PhotometricStereoResult solve_normals(SessionPhotos& photos, const Calibration& calibration,
                                      PhotometricStereoOptions options, const WorkContext& work) {
    options.geometry.view = calibration.view;
    PhotometricStereoResult solved = photometric_stereo(photos, calibration.lights, options, work);
    const bool near = std::any_of(calibration.lights.begin(), calibration.lights.end(),
                                  [](const Light& light) { return light.used && light.near; });
    for (int pass = 0; near && pass < near_light_passes; ++pass) {
        options.geometry.height_mm = integrate_normals({solved.normals, calibration.view}, {}, work).height;
        photos.rewind();
        solved = photometric_stereo(photos, calibration.lights, options, work);
    }
    return solved;
}

void write_confidence(const std::filesystem::path& path, const PhotometricStereoResult& solved) {
    write_exr_rows(path, solved.residual.size(), {"lights_used", "residual", "sigma_deg"},
                   [&](int row, float* samples) {
                       for (int x = 0; x < solved.residual.cols; ++x) {
                           *samples++ = static_cast<float>(solved.lights_used(row, x));
                           *samples++ = solved.residual(row, x);
                           *samples++ = solved.sigma_deg(row, x);
                       }
                   });
}

/// All files at a time: while one waits for the disk, another is encoded.
void write_maps(const ResultFiles& files, const PhotometricStereoResult& solved, const WorkContext& work) {
    step(work, {"writing maps", 0, 1, files.results_folder.string()});
    on_threads_of(work, [&] {
        tbb::parallel_invoke([&] { write_normal_map(files.normals, solved.normals); },
                             [&] { write_normal_map(files.normals_png, solved.normals); },
                             [&] { write_albedo_map(files.albedo, solved.albedo); },
                             [&] {
                                 const double gain = viewing_gain(solved.albedo.albedo, solved.albedo.valid);
                                 write_albedo_map(files.albedo_png, solved.albedo, gain);
                             },
                             [&] { write_confidence(files.confidence, solved); });
    });
}

}  // namespace

NormalsSummary run_normals(const Session& session, const NormalsOptions& options, const WorkContext& work) {
    options.stereo.validate();
    const ResultFiles files(session.folder());
    require_made(files.calibration, session, "calibrate");
    StoredCalibration stored = read_calibration(files.calibration);
    require_solvable(stored.calibration.lights);
    NormalsSummary summary;
    Stopwatch watch;
    SessionPhotos photos(session);
    PhotometricStereoResult solved = solve_normals(photos, stored.calibration, options.stereo, work);
    require_any_normal(solved);
    const ChosenIntensities chosen =
        choose_intensities(photos.kept_stack(), std::move(stored.calibration), options.intensities, work);
    const Calibration& calibration = chosen.calibration;
    const Lights& lights = calibration.lights;
    if (chosen.changed) {  // later stages find the estimate in the calibration
        write_calibration(files.calibration, calibration, stored.rig);
        photos.rewind();
        solved = solve_normals(photos, calibration, options.stereo, work);
    }
    summary.warnings = chosen.warnings;
    summary.intensity_origin = calibration.intensity_origin;
    summary.lights = lights;
    summary.seconds.solve = solved.seconds;
    summary.seconds.read = std::max(0.0, watch.lap() - solved.seconds);
    summary.solver = name(options.stereo.solver);
    summary.body = solved.model.law.name();
    summary.gloss = solved.model.gloss.name();
    summary.images = static_cast<std::size_t>(direction_matrix(lights).rows());
    summary.pixels = solved.pixels;
    summary.residual_rms = solved.residual_rms;
    summary.mean_angular_error_deg = error_against_truth(session, solved.normals);
    const double megapixels = static_cast<double>(photos.size().area()) / 1e6;
    summary.megapixel_images_per_second =
        megapixels * static_cast<double>(summary.images) / std::max(solved.seconds, 1e-9);
    if (const auto curve = doubtful_curve(session))
        if (const auto warning = transfer_warning(photos.kept_rows(), photos.kept_mask(), lights, *curve, work))
            summary.warnings.push_back(*warning);
    FrameTally tally;
    tally.add(photos.kept_stack());
    for (std::string& warning : tally.warnings(lights)) summary.warnings.push_back(std::move(warning));
    watch.lap();
    remove_derived(session, {"texels", "shading"});
    write_maps(files, solved, work);
    for (const auto& stale : {files.height, files.surface}) std::filesystem::remove(stale);
    if (options.surface) summary.height = write_surface(files, solved, calibration.view, work);
    summary.seconds.write = watch.lap();
    write_json(files.results_summary, to_json(summary));
    step(work, {"writing maps", 1, 1, ""});
    return summary;
}

}  // namespace darkbox
