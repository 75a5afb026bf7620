#include <algorithm>

#include "processing/formats/calibration_file.h"
#include "processing/formats/exr.h"
#include "processing/formats/json_file.h"
#include "processing/formats/map_files.h"
#include "processing/formats/ply.h"
#include "processing/formats/srgb.h"
#include "processing/normals/integrate.h"
#include "processing/pipeline/angular_error.h"
#include "processing/pipeline/frame_tally.h"
#include "processing/pipeline/session_files.h"
#include "processing/pipeline/stack.h"
#include "processing/pipeline/stages.h"
#include "processing/pipeline/steps.h"
#include "processing/pipeline/summary_json.h"
#include "processing/pipeline/transfer_check.h"

namespace darkbox {
namespace {

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

void write_maps(const ResultFiles& files, const PhotometricStereoResult& solved, const WorkContext& work) {
    step(work, {"integrating height", 0, 1, ""});
    const cv::Mat1f height = integrate_normals(solved.normals);
    step(work, {"writing maps", 0, 1, files.results_folder.string()});
    write_normal_map(files.normals, solved.normals);
    write_normal_map(files.normals_png, solved.normals);
    write_albedo_map(files.albedo, solved.albedo);
    write_albedo_map(files.albedo_png, solved.albedo, viewing_gain(solved.albedo.albedo, solved.albedo.valid));
    cv::Mat1f used;
    solved.lights_used.convertTo(used, CV_32F);
    write_exr(files.confidence, {{"lights_used", used}, {"residual", solved.residual}});
    write_exr(files.height, height);
    write_ply(files.surface, height, solved.normals, solved.albedo);
}

/// The calibration's lights. Intensities that had to be estimated are kept there, with their origin.
Lights use_lights(const Session& session, const PhotoStack& stack, IntensityChoice choice, NormalsSummary& summary,
                  const WorkContext& work) {
    const ResultFiles files(session.folder());
    StoredCalibration stored = read_calibration(files.calibration);
    ChosenIntensities chosen = choose_intensities(stack, std::move(stored.calibration), choice, work);
    if (chosen.changed) write_calibration(files.calibration, chosen.calibration, stored.rig);
    summary.warnings = std::move(chosen.warnings);
    summary.intensity_origin = chosen.calibration.intensity_origin;
    summary.lights = std::move(chosen.calibration.lights);
    return summary.lights;
}

}  // namespace

NormalsSummary run_normals(const Session& session, const NormalsOptions& options, const WorkContext& work) {
    options.validate();
    const ResultFiles files(session.folder());
    require_solvable(load_lights(session));
    NormalsSummary summary;
    Stopwatch watch;
    const PhotoStack stack = load_stack(session, work);
    summary.seconds.read = watch.lap();
    const Lights lights = use_lights(session, stack, options.intensities, summary, work);
    step(work, {"solving normals", 0, 1, ""});
    const PhotometricStereoResult solved = photometric_stereo(stack, lights, options, work);
    watch.lap();
    summary.seconds.solve = solved.seconds;
    summary.solver = "lsq";
    summary.images = static_cast<std::size_t>(direction_matrix(lights).rows());
    summary.pixels = solved.pixels;
    summary.residual_rms = solved.residual_rms;
    summary.mean_angular_error_deg = error_against_truth(session, solved.normals);
    const double megapixels = static_cast<double>(stack.mask.total()) / 1e6;
    summary.megapixel_images_per_second =
        megapixels * static_cast<double>(summary.images) / std::max(solved.seconds, 1e-9);
    if (const auto curve = doubtful_curve(session))
        if (const auto warning = transfer_warning(stack, lights, *curve, solved.residual_rms, work))
            summary.warnings.push_back(*warning);
    FrameTally tally;
    tally.add(stack);
    for (std::string& warning : tally.warnings(lights)) summary.warnings.push_back(std::move(warning));
    watch.lap();
    remove_derived(session, {"texels", "shading"});
    write_maps(files, solved, work);
    summary.seconds.write = watch.lap();
    write_json(files.results_summary, to_json(summary));
    step(work, {"writing maps", 1, 1, ""});
    return summary;
}

}  // namespace darkbox
