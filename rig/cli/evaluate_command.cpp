#include <fmt/format.h>

#include <map>
#include <memory>

#include "acquisition/frame/error.h"
#include "processing/normals/solver_names.h"
#include "processing/pipeline/evaluate.h"
#include "rig/cli/choices.h"
#include "rig/cli/commands.h"

namespace darkbox {
namespace {

namespace fs = std::filesystem;

constexpr std::array<std::pair<LightGroup, const char*>, 3> groups{
    {{LightGroup::interior, "interior"}, {LightGroup::hull, "hull"}, {LightGroup::every, "every"}}};

Json to_json(const AngularError& error) {
    return {{"mean_deg", error.mean_deg},
            {"median_deg", error.median_deg},
            {"p95_deg", error.p95_deg},
            {"max_deg", error.max_deg},
            {"count", error.count}};
}

Json to_json(const LightErrors& errors) {
    Json json = to_json(errors.all);
    json["each"] = Json::array();
    for (std::size_t i = 0; i < errors.files.size(); ++i)
        json["each"].push_back({{"file", errors.files[i]}, {"error_deg", errors.error_deg[i]}});
    return json;
}

Json to_json(const SolverComparison::One& one) {
    Json json = to_json(one.error);
    json["solver"] = name(one.solver);
    json["seconds"] = one.seconds;
    return json;
}

Json to_json(const SolverComparison& comparison, const PairedBootstrapOptions& options) {
    const PairedBootstrap& difference = comparison.difference;
    return {{"solvers", {to_json(comparison.first), to_json(comparison.second)}},
            {"difference",
             {{"mean_deg", difference.mean_difference},
              {"low_deg", difference.low},
              {"high_deg", difference.high},
              {"confidence", options.confidence},
              {"pixels", difference.pixels},
              {"blocks", difference.blocks},
              {"block_px", options.block_px},
              {"resamples", options.resamples}}},
            {"second_is_better", comparison.second_is_better()}};
}

Json to_json(const PredictionError& error) {
    return {{"rmse_relative", error.rmse_relative}, {"psnr_db", error.psnr_db}, {"pixels", error.pixels}};
}

Json to_json(const PredictionErrors& errors) {
    Json json = Json::object();
    for (std::size_t kind = 0; kind < errors.size(); ++kind)
        if (errors[kind]) json[name(pixel_kinds[kind])] = to_json(*errors[kind]);
    return json;
}

/// rmse_relative and psnr_db over all of the object stand first, as the documented keys; the kinds of pixels follow.
Json to_json(const HeldOutLight& light, const std::vector<std::string>& predictors) {
    Json json{{"file", light.file},
              {"hull", light.hull},
              {"normal_change_deg", light.normal_change_deg},
              {"rmse_relative", Json::object()},
              {"psnr_db", Json::object()},
              {"by_kind", Json::object()}};
    for (std::size_t p = 0; p < light.errors.size(); ++p) {
        if (const auto& all = light.errors[p].front()) {
            json["rmse_relative"][predictors[p]] = all->rmse_relative;
            json["psnr_db"][predictors[p]] = all->psnr_db;
        }
        json["by_kind"][predictors[p]] = to_json(light.errors[p]);
    }
    return json;
}

Json to_json(const MeanErrors& means) {
    Json json = to_json(means.errors);
    for (std::size_t kind = 0; kind < pixel_kinds.size(); ++kind)
        if (means.errors[kind]) json[name(pixel_kinds[kind])]["photographs"] = means.photographs[kind];
    return json;
}

Json means_json(const Evaluation& evaluation) {
    Json json = Json::object();
    for (std::size_t p = 0; p < evaluation.predictors.size(); ++p)
        for (const auto& [group, label] : groups)
            json[evaluation.predictors[p]][label] = to_json(mean_errors(evaluation.held_out, p, group));
    return json;
}

Json to_json(const Evaluation& evaluation, const EvaluateOptions& options) {
    Json json{{"solver", name(evaluation.solver)}};
    if (evaluation.normals) {
        json["mean_angular_error_deg"] = evaluation.normals->mean_deg;
        json["normals"] = to_json(*evaluation.normals);
    }
    if (const auto& sphere = evaluation.ideal_sphere)
        json["ideal_sphere"] = {{"x", sphere->x}, {"y", sphere->y}, {"radius", sphere->radius}};
    if (evaluation.comparison) json["comparison"] = to_json(*evaluation.comparison, options.bootstrap);
    if (evaluation.lights) json["lights"] = to_json(*evaluation.lights);
    if (!evaluation.held_out.empty()) {
        json["held_out"] = Json::array();
        for (const HeldOutLight& light : evaluation.held_out)
            json["held_out"].push_back(to_json(light, evaluation.predictors));
        json["held_out_mean"] = means_json(evaluation);
    }
    json["warnings"] = evaluation.warnings;
    return json;
}

std::string describe(const char* what, const AngularError& error, const char* of) {
    return fmt::format("{}: mean {:.3f}, median {:.3f}, 95th percentile {:.3f}, worst {:.3f} degrees over {} {}\n",
                       what, error.mean_deg, error.median_deg, error.p95_deg, error.max_deg, error.count, of);
}

std::string describe(const SolverComparison& comparison, const PairedBootstrapOptions& options) {
    std::string text;
    for (const SolverComparison::One* one : {&comparison.first, &comparison.second})
        text += describe(fmt::format("{} ({:.2f} s)", name(one->solver), one->seconds).c_str(), one->error, "pixels");
    const PairedBootstrap& difference = comparison.difference;
    const char* verdict = comparison.second_is_better() ? "is better"
                          : difference.low > 0          ? "is worse"
                                                        : "is not told apart";
    return text + fmt::format(
                      "{} less {}: {:+.3f} degrees, {:.0f} % interval {:+.3f} to {:+.3f}: {} {} (bootstrap of {} "
                      "blocks of {} px, {} times)\n",
                      name(comparison.second.solver), name(comparison.first.solver), difference.mean_difference,
                      100 * options.confidence, difference.low, difference.high, name(comparison.second.solver),
                      verdict, difference.blocks, options.block_px, options.resamples);
}

std::string cells(const PredictionErrors& errors) {
    std::string text;
    for (const auto& error : errors)
        text += error ? fmt::format(" {:9.4f} {:5.1f} dB", error->rmse_relative, error->psnr_db)
                      : fmt::format(" {:>18}", "-");
    return text;
}

std::string held_out_table(const Evaluation& evaluation, std::size_t predictor) {
    std::size_t width = std::string("photograph").size();
    for (const HeldOutLight& light : evaluation.held_out) width = std::max(width, light.file.size());
    std::string text = fmt::format(
        "each photograph predicted without it by {}, normals by {}: error relative to the "
        "photograph's mean, and PSNR\n{:{}}  {:8}",
        evaluation.predictors[predictor], name(evaluation.solver), "photograph", width, "light");
    for (const PixelKind kind : pixel_kinds) text += fmt::format(" {:>18}", name(kind));
    text += "  normals move\n";
    for (const HeldOutLight& light : evaluation.held_out) {
        if (light.errors.empty()) continue;
        text += fmt::format("{:{}}  {:8}{}  {:9.3f} deg\n", light.file, width, light.hull ? "hull" : "interior",
                            cells(light.errors[predictor]), light.normal_change_deg);
    }
    for (const auto& [group, label] : groups) {
        const MeanErrors means = mean_errors(evaluation.held_out, predictor, group);
        if (means.errors.front())
            text += fmt::format("{:{}}  {:8}{}  of {} photographs\n", "mean", width, label, cells(means.errors),
                                means.photographs.front());
    }
    return text;
}

std::string describe(const Evaluation& evaluation, const EvaluateOptions& options) {
    std::string text;
    if (const auto& sphere = evaluation.ideal_sphere)
        text += fmt::format("truth: a sphere seen at ({:.2f}, {:.2f}), radius {:.2f} px\n", sphere->x, sphere->y,
                            sphere->radius);
    if (evaluation.normals)
        text += describe(fmt::format("normals ({})", name(evaluation.solver)).c_str(), *evaluation.normals, "pixels");
    if (evaluation.comparison) text += describe(*evaluation.comparison, options.bootstrap);
    if (evaluation.lights) text += describe("lights", evaluation.lights->all, "lights");
    if (!evaluation.held_out.empty())
        for (std::size_t p = 0; p < evaluation.predictors.size(); ++p) text += held_out_table(evaluation, p);
    if (!text.empty()) text.pop_back();
    return text;
}

struct EvaluateArguments {
    fs::path session;
    EvaluateOptions options;
    fs::path lights;
    bool ideal_sphere = false;
    bool no_held_out = false;
};

CommandResult evaluate(const EvaluateArguments& arguments, const WorkContext& work) {
    EvaluateOptions options = arguments.options;
    if (!arguments.lights.empty()) options.reference_lights = arguments.lights;
    if (arguments.ideal_sphere) options.truth = NormalTruth::ideal_sphere;
    options.held_out = !arguments.no_held_out;
    const Session session = Session::open(arguments.session);
    session.verify();
    const Evaluation evaluation = evaluate_session(session, options, work);
    if (!evaluation.normals && !evaluation.comparison && !evaluation.lights && evaluation.held_out.empty())
        throw InputError("there is nothing to evaluate: no truth came with the photographs",
                         "leave --no-held-out out, or give --lights FILE or --ideal-sphere");
    return {to_json(evaluation, options), describe(evaluation, options), evaluation.warnings};
}

}  // namespace

void add_evaluate_command(CommandLine& line) {
    const auto a = std::make_shared<EvaluateArguments>();
    CLI::App& command =
        line.add("evaluate", "Predict each photograph without it; errors against the truth where it is known",
                 "darkbox evaluate s --solver lsq", [a](const WorkContext& work) { return evaluate(*a, work); });
    command.add_option("session", a->session, "The session's folder")->required();
    std::map<std::string, Solver> solvers;
    for (const auto& [solver, text] : solver_names) solvers.emplace(text, solver);
    command.add_option("--solver", a->options.solver, "Solve again with this (else as the results were made)")
        ->transform(one_of(solvers));
    command
        .add_option("--compare-solvers", a->options.compare, "Two solvers, compared against the truth pixel by pixel")
        ->expected(2)
        ->transform(one_of(solvers));
    command.add_option("--drop", a->options.drop, "Frames to leave out of everything");
    command.add_flag("--ideal-sphere", a->ideal_sphere, "The object is a ball: the sphere in its mask is the truth");
    command.add_option("--block", a->options.bootstrap.block_px, "Side of the blocks that --compare-solvers draws, px")
        ->capture_default_str();
    command.add_option("--lights", a->lights, "True light directions, in the frames' order");
    command
        .add_option("--memory-mib", a->options.memory_mib, "Memory for all photographs and what is solved from them")
        ->capture_default_str();
    command.add_flag("--no-held-out", a->no_held_out, "Skip the prediction of each photograph without it");
}

}  // namespace darkbox
