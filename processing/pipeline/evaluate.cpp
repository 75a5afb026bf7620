#include "processing/pipeline/evaluate.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <utility>

#include "acquisition/frame/error.h"
#include "processing/formats/json_file.h"
#include "processing/formats/light_files.h"
#include "processing/formats/map_files.h"
#include "processing/normals/solver_names.h"
#include "processing/pipeline/ideal_sphere.h"
#include "processing/pipeline/radiance.h"
#include "processing/pipeline/session_files.h"
#include "processing/pipeline/session_geometry.h"
#include "processing/pipeline/solved.h"
#include "processing/pipeline/stack.h"
#include "processing/pipeline/stages.h"
#include "processing/pipeline/steps.h"

namespace darkbox {
namespace {

namespace fs = std::filesystem;

std::optional<NormalMap> known_normals(const Session& session) {
    if (const auto given = extra_of(session, given_truth)) return read_normal_truth(*given);
    const fs::path simulated = session.folder() / "truth" / "normals.exr";
    if (fs::exists(simulated)) return read_normal_map(simulated);
    return std::nullopt;
}

std::optional<fs::path> known_lights(const Session& session, const EvaluateOptions& options) {
    if (options.reference_lights) return options.reference_lights;
    const fs::path simulated = session.folder() / "truth" / "lights.lp";
    return fs::exists(simulated) ? std::optional(simulated) : std::nullopt;
}

std::optional<LightErrors> light_errors(const Lights& computed, const fs::path& truth_file) {
    const Lights truth = read_lights(truth_file).lights;
    if (truth.size() != computed.size())
        throw InputError(fmt::format("{} has {} lights but the calibration has {}", truth_file.string(), truth.size(),
                                     computed.size()),
                         "give one light for each photograph, in their order, or calibrate the session again");
    LightErrors errors;
    for (std::size_t i = 0; i < truth.size(); ++i) {
        if (!computed[i].used) continue;
        errors.files.push_back(computed[i].file);
        errors.error_deg.push_back(angle_deg(truth[i].direction, computed[i].direction));
    }
    const auto all = summarise_angles(errors.error_deg);
    if (!all) return std::nullopt;
    errors.all = *all;
    return errors;
}

Lights lights_without(Lights lights, const std::vector<std::string>& dropped) {
    for (const std::string& file : dropped) {
        const auto light = std::find_if(lights.begin(), lights.end(), [&](const Light& l) { return l.file == file; });
        if (light == lights.end())
            throw InputError(fmt::format("there is no frame {} to leave out", file),
                             lights.empty() ? "the session has no lights"
                                            : fmt::format("name a frame as {} is named", lights.front().file));
        light->used = false;
    }
    return lights;
}

Solver solver_of_results(const ResultFiles& files) {
    if (!fs::exists(files.results_summary)) return Solver::lsq;
    const auto json = read_json(files.results_summary);
    return reading_keys(files.results_summary, "a summary of normals",
                        [&] { return solver_named(json.at("solver").get<std::string>()); });
}

/// The session's photographs are read, and solved, only when something asks for them.
class Bench {
public:
    Bench(const Session& session, const EvaluateOptions& options, const WorkContext& work)
        : session_(session), options_(options), work_(work), files_(session.folder()) {
        Calibration calibration = load_calibration(session);
        if (calibration.intensity_origin == IntensityOrigin::estimated) intensities_ = HeldOutIntensities::estimated;
        lights_ = lights_without(std::move(calibration.lights), options.drop);
        solver_ = options.solver ? *options.solver : solver_of_results(files_);
        geometry_ = scene_geometry(files_);
    }

    const Lights& lights() const { return lights_; }
    Solver solver() const { return solver_; }
    HeldOutIntensities intensities() const { return intensities_; }

    const PhotoStack& stack() {
        if (!stack_) stack_ = load_stack(session_, work_);
        return *stack_;
    }

    PhotometricStereoOptions solving_with(Solver solver) const {
        PhotometricStereoOptions options;
        options.solver = solver;
        options.geometry = geometry_;
        return options;
    }

    PhotometricStereoResult solve(Solver solver) {
        const PhotoStack& photographs = stack();
        step(work_, {"solving normals", 0, 1, std::string(name(solver))});
        PhotometricStereoResult solved = photometric_stereo(photographs, lights_, solving_with(solver), work_);
        require_any_normal(solved, photographs);
        return solved;
    }

    bool normals_stored() const { return !options_.solver && options_.drop.empty() && fs::exists(files_.normals); }

    NormalMap normals() { return normals_stored() ? read_normal_map(files_.normals) : solve(solver_).normals; }

private:
    const Session& session_;
    const EvaluateOptions& options_;
    const WorkContext& work_;
    ResultFiles files_;
    Lights lights_;
    HeldOutIntensities intensities_ = HeldOutIntensities::given;
    Solver solver_ = Solver::lsq;
    SceneGeometry geometry_;
    std::optional<PhotoStack> stack_;
};

/// Whether anything asked for needs more than what the session's results say.
bool needs_photographs(const Bench& bench, const EvaluateOptions& options) {
    return options.held_out || options.truth == NormalTruth::ideal_sphere || !options.compare.empty() ||
           !bench.normals_stored();
}

/// All photographs are held, since each is predicted from all others: better said before than found out by the kernel.
void require_memory(const Session& session, int memory_mib) {
    constexpr std::size_t radiance = sizeof(cv::Vec3f) + 1;
    constexpr std::size_t fits =
        350;  // bytes a pixel: three solved sets of maps, a scene and its shading, a prediction
    const std::vector<FrameRecord> photographs = require_lit(session);
    const cv::Size size = FrameBands(session, {photographs.front()}).size();
    const std::size_t need =
        ((static_cast<std::size_t>(size.area()) * (photographs.size() * radiance + fits)) >> 20) + 1;
    if (need > static_cast<std::size_t>(memory_mib))
        throw InputError(fmt::format("memory_mib is {}, but evaluating {} photographs of {}x{} pixels needs {}",
                                     memory_mib, photographs.size(), size.width, size.height, need),
                         "allow more memory with --memory-mib, or import the photographs scaled down");
}

/// Throws where it was asked for and is not to be had.
std::optional<NormalMap> truth_of_normals(const Session& session, const EvaluateOptions& options, Bench& bench,
                                          Evaluation& evaluation) {
    if (options.truth == NormalTruth::ideal_sphere) {
        IdealSphere sphere = ideal_sphere(bench.stack().mask);
        evaluation.ideal_sphere = sphere.outline;
        return std::move(sphere.normals);
    }
    auto truth = known_normals(session);
    if (!truth && !options.compare.empty())
        throw InputError(fmt::format("no true normals are known of {}", session.folder().string()),
                         "solvers are compared on simulated captures, on imports with Normal_gt.mat, and on a matte "
                         "ball with --ideal-sphere");
    return truth;
}

std::vector<double> known_in_both(const cv::Mat1d& errors, const cv::Mat1d& others) {
    std::vector<double> known;
    for (int y = 0; y < errors.rows; ++y)
        for (int x = 0; x < errors.cols; ++x)
            if (!std::isnan(errors(y, x)) && !std::isnan(others(y, x))) known.push_back(errors(y, x));
    return known;
}

SolverComparison compare_solvers(Bench& bench, const NormalMap& truth, const EvaluateOptions& options) {
    const PhotometricStereoResult first = bench.solve(options.compare[0]);
    const PhotometricStereoResult second = bench.solve(options.compare[1]);
    const cv::Mat1d first_deg = angles_between_deg(first.normals, truth);
    const cv::Mat1d second_deg = angles_between_deg(second.normals, truth);
    SolverComparison comparison;
    comparison.difference = paired_bootstrap(first_deg, second_deg, options.bootstrap);
    comparison.first = {options.compare[0], *summarise_angles(known_in_both(first_deg, second_deg)), first.seconds};
    comparison.second = {options.compare[1], *summarise_angles(known_in_both(second_deg, first_deg)), second.seconds};
    return comparison;
}

void leave_lights_out(Bench& bench, const WorkContext& work, Evaluation& evaluation) {
    const auto used =
        std::count_if(bench.lights().begin(), bench.lights().end(), [](const Light& light) { return light.used; });
    if (used < 4) {
        evaluation.warnings.push_back(
            fmt::format("{} lights are too few to leave one out: the others could not tell normals", used));
        return;
    }
    const std::vector<Predictor> predictors = every_predictor();
    for (const Predictor& predictor : predictors) evaluation.predictors.push_back(predictor.name);
    evaluation.held_out = leave_one_light_out(bench.stack(), bench.lights(), bench.solve(Solver::robust), predictors,
                                              bench.solving_with(bench.solver()), bench.intensities(), work);
    for (const HeldOutLight& light : evaluation.held_out)
        if (light.errors.empty())
            evaluation.warnings.push_back(fmt::format(
                "{} cannot be left out: the other lights do not tell normals and intensities alone", light.file));
}

}  // namespace

void EvaluateOptions::validate() const {
    bootstrap.validate();
    if (memory_mib < 1) throw InputError(fmt::format("memory_mib is {}", memory_mib), "allowed: 1 or more");
    if (!compare.empty() && compare.size() != 2)
        throw InputError(fmt::format("compare names {} solvers", compare.size()), "allowed: none, or two");
}

Evaluation evaluate_session(const Session& session, const EvaluateOptions& options, const WorkContext& work) {
    options.validate();
    Bench bench(session, options, work);
    if (needs_photographs(bench, options)) require_memory(session, options.memory_mib);
    Evaluation evaluation;
    evaluation.solver = bench.solver();
    if (const auto truth = truth_of_normals(session, options, bench, evaluation)) {
        evaluation.normals = angular_error(bench.normals(), *truth);
        if (!options.compare.empty()) evaluation.comparison = compare_solvers(bench, *truth, options);
    }
    if (const auto lights = known_lights(session, options)) evaluation.lights = light_errors(bench.lights(), *lights);
    if (options.held_out) leave_lights_out(bench, work, evaluation);
    return evaluation;
}

}  // namespace darkbox
