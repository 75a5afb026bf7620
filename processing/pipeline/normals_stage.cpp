#include <fmt/format.h>
#include <fmt/ranges.h>
#include <tbb/parallel_invoke.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <initializer_list>
#include <iterator>
#include <memory>
#include <opencv2/imgproc.hpp>

#include "acquisition/frame/error.h"
#include "processing/formats/calibration_file.h"
#include "processing/formats/exr.h"
#include "processing/formats/json_file.h"
#include "processing/formats/map_files.h"
#include "processing/formats/ply.h"
#include "processing/maps/parallel.h"
#include "processing/maps/srgb.h"
#include "processing/normals/integrate.h"
#include "processing/normals/integration_memory.h"
#include "processing/normals/solver_names.h"
#include "processing/pipeline/angular_error.h"
#include "processing/pipeline/frame_tally.h"
#include "processing/pipeline/lights_check.h"
#include "processing/pipeline/provenance.h"
#include "processing/pipeline/session_files.h"
#include "processing/pipeline/solved.h"
#include "processing/pipeline/stack.h"
#include "processing/pipeline/stages.h"
#include "processing/pipeline/steps.h"
#include "processing/pipeline/summary_json.h"
#include "processing/pipeline/transfer_check.h"

namespace darkbox {
namespace {

namespace fs = std::filesystem;

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
    const auto lit = photographs_of(session, FrameKind::lit);
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

/// `box`: where the object is. Beside normals and albedo, and the height map itself.
void require_memory_for_height(const cv::Rect& box, cv::Size picture, int memory_mib, const char* remedy) {
    constexpr std::size_t maps = 2 * (sizeof(cv::Vec3f) + 1) + sizeof(float) + 2;
    const std::size_t need = static_cast<std::size_t>(picture.area()) * maps + integration_bytes(box.size());
    if (need > static_cast<std::size_t>(memory_mib) << 20)
        throw InputError(fmt::format("memory_mib is {}, but the height of an object of {}x{} pixels needs {}",
                                     memory_mib, box.width, box.height, (need >> 20) + 1),
                         remedy);
}

constexpr const char* without_surface = "allow more memory with --memory-mib, or leave the surface out: --no-surface";
constexpr const char* near_needs_height =
    "allow more memory with --memory-mib: near lamps need to know where the surface lies";

void release_confidence(PhotometricStereoResult& solved) {
    for (cv::Mat* map : std::initializer_list<cv::Mat*>{&solved.residual, &solved.lights_used, &solved.sigma_deg})
        map->release();
}

HeightFacts write_surface(const ResultFiles& files, const PhotometricStereoResult& solved,
                          const std::optional<ViewGeometry>& view, const WorkContext& work) {
    step(work, {"integrating height", 0, 1, ""});
    const HeightMap height = integrate_normals({solved.normals, view}, {}, work);
    write_exr(files.height, height.height);
    return facts_of(height, write_ply(files.surface, height, solved.normals, solved.albedo, view));
}

/// Near lights and near cameras need to know where each pixel lies: first in the plane z = 0, then on the surface that
/// the last normals gave, which is left in `options`.
PhotometricStereoResult solve_normals(SessionPhotos& photos, const Calibration& calibration,
                                      PhotometricStereoOptions& options, const WorkContext& work) {
    options.geometry.view = calibration.view;
    PhotometricStereoResult solved = photometric_stereo(photos, calibration.lights, options, work);
    const bool near = std::any_of(calibration.lights.begin(), calibration.lights.end(),
                                  [](const Light& light) { return light.used && light.near; });
    for (int pass = 0; near && pass < near_light_passes; ++pass) {
        require_memory_for_height(cv::boundingRect(solved.normals.valid), photos.size(), options.memory_mib,
                                  near_needs_height);
        release_confidence(solved);
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

/// Photographs that show nothing say nothing of normals, and least squares would take them at their word.
std::vector<std::string> leave_out_black(const FrameTally& tally, const PhotoStack& stack, Lights& lights) {
    std::vector<std::string> words;
    for (const std::size_t i : tally.black(lights)) {
        lights[i].used = false;
        words.push_back(
            fmt::format("{} is black wherever the object is, and was left out: was its lamp on?", stack.files[i]));
    }
    if (!words.empty() && !(condition_number(lights) < HUGE_VAL))
        throw InputError(fmt::format("{}; what remains does not tell normals", fmt::join(words, "; ")),
                         "take the photographs again with all lamps on");
    return words;
}

/// What the session's normals come from.
struct SolvedSession {
    Calibration calibration;
    PhotometricStereoResult stereo;
    std::vector<std::string> warnings;
    double solve_seconds = 0;
    double intensity_seconds = 0;
};

/// Lights that turn out to be useless, and intensities that are found, go into the calibration, where later stages find
/// them.
SolvedSession solve_session(SessionPhotos& photos, const fs::path& calibration_file, const NormalsOptions& options,
                            const WorkContext& work) {
    StoredCalibration stored = read_calibration(calibration_file);
    require_solvable(stored.calibration.lights);
    SolvedSession solved;
    PhotometricStereoOptions stereo = options.stereo;
    solved.stereo = solve_normals(photos, stored.calibration, stereo, work);
    solved.solve_seconds = solved.stereo.seconds;
    const PhotoStack kept = photos.kept_stack();
    require_any_normal(solved.stereo, kept);
    FrameTally tally;
    tally.add(kept, stored.calibration.lights);
    solved.warnings = leave_out_black(tally, kept, stored.calibration.lights);
    const bool fewer = !solved.warnings.empty();
    Stopwatch watch;
    ChosenIntensities chosen = choose_intensities(kept, std::move(stored.calibration), options.intensities,
                                                  stereo.geometry, photos.kept_row_step(), work);
    solved.intensity_seconds = watch.lap();
    solved.calibration = std::move(chosen.calibration);
    append(solved.warnings, std::move(chosen.warnings));
    if (chosen.changed || fewer) {
        write_calibration(calibration_file, solved.calibration, stored.rig);
        photos.rewind();
        stereo = options.stereo;
        solved.stereo = solve_normals(photos, solved.calibration, stereo, work);
        solved.solve_seconds += solved.stereo.seconds;
    }
    append(solved.warnings, tally.warnings(solved.calibration.lights));
    return solved;
}

/// What the photographs themselves say against how they were read or lit. A wrong curve makes lights look wrong, too.
std::optional<std::string> contradiction(const Session& session, const SessionPhotos& photos, const Lights& lights,
                                         const WorkContext& work) {
    if (const auto curve = doubtful_curve(session))
        if (auto warning = transfer_warning(photos.kept_rows(), photos.kept_mask(), lights, *curve, work))
            return warning;
    return lights_warning(photos.kept_stack(), lights);
}

NormalsSummary summary_of(const Session& session, const SolvedSession& solved, const NormalsOptions& options,
                          cv::Size size) {
    const PhotometricStereoResult& stereo = solved.stereo;
    NormalsSummary summary;
    summary.intensity_origin = solved.calibration.intensity_origin;
    summary.lights = solved.calibration.lights;
    summary.seconds.solve = solved.solve_seconds;
    summary.intensity_seconds = solved.intensity_seconds;
    summary.solver = name(options.stereo.solver);
    summary.body = stereo.model.law.name();
    summary.gloss = stereo.model.gloss.name();
    summary.images = static_cast<std::size_t>(direction_matrix(summary.lights).rows());
    summary.pixels = stereo.pixels;
    summary.residual_rms = stereo.residual_rms;
    summary.mean_angular_error_deg = error_against_truth(session, stereo.normals);
    const double megapixels = static_cast<double>(size.area()) / 1e6;
    summary.megapixel_images_per_second =
        megapixels * static_cast<double>(summary.images) / std::max(stereo.seconds, 1e-9);
    summary.warnings = solved.warnings;
    return summary;
}

}  // namespace

NormalsSummary run_normals(const Session& session, const NormalsOptions& given, const WorkContext& work) {
    given.stereo.validate();
    const ResultFiles files(session.folder());
    require_made(files.calibration, session, "calibrate");
    Stopwatch watch;
    auto photos = std::make_unique<SessionPhotos>(session);
    const cv::Size size = photos->size();
    NormalsOptions options = given;
    std::optional<SampleUses> uses;
    if (options.shadows) options.stereo.uses = &uses.emplace(files.shadows, size, photos->count());
    options.stereo.validate();
    const auto require_height = [&](const cv::Mat1b& object) {
        if (options.surface)
            require_memory_for_height(cv::boundingRect(object), size, options.stereo.memory_mib, without_surface);
    };
    if (extra_of(session, object_mask)) require_height(photos->mask());  // before any work is done in vain
    SolvedSession solved = solve_session(*photos, files.calibration, options, work);
    require_height(solved.stereo.normals.valid);
    NormalsSummary summary = summary_of(session, solved, options, size);
    summary.seconds.read = std::max(0.0, watch.lap() - solved.solve_seconds - solved.intensity_seconds);
    if (auto warning = contradiction(session, *photos, summary.lights, work))
        summary.warnings.push_back(std::move(*warning));
    photos.reset();
    watch.lap();
    summary.removed = remove_derived(session, {"texels", "shading"});
    write_maps(files, solved.stereo, work);
    release_confidence(solved.stereo);
    for (const auto& stale : {files.height, files.surface, files.shadows}) std::filesystem::remove_all(stale);
    if (uses) summary.shadows = uses->write(summary.lights, solved.stereo.normals.valid, work);
    if (options.surface) summary.height = write_surface(files, solved.stereo, solved.calibration.view, work);
    summary.seconds.write = watch.lap();
    write_json(files.results_summary, to_json(summary));
    describe_pictures(session, "normals", {files.normals_png});
    describe_pictures(session, "albedo", {files.albedo_png});
    step(work, {"writing maps", 1, 1, ""});
    return summary;
}

}  // namespace darkbox
