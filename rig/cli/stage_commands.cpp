#include <fmt/format.h>
#include <fmt/ranges.h>

#include <memory>

#include "processing/normals/solver_names.h"
#include "processing/pipeline/shade_stage.h"
#include "processing/pipeline/stages.h"
#include "processing/pipeline/summary_json.h"
#include "rig/cli/arguments.h"
#include "rig/cli/choices.h"
#include "rig/cli/commands.h"

namespace darkbox {
namespace {

constexpr int default_memory_mib = 4096;

struct StageArguments {
    StageArguments() { options.normals.stereo.memory_mib = default_memory_mib; }

    std::filesystem::path session;
    ProcessOptions options;
    std::vector<std::string> balls;
    std::filesystem::path ball_mask;
    std::filesystem::path from;
    std::vector<std::string> highlights;
    std::string grey_card;
    std::filesystem::path grey_card_mask;
};

/// The arguments as options, and those that need parsing parsed.
ProcessOptions options_of(const StageArguments& arguments) {
    ProcessOptions options = arguments.options;
    CalibrationOptions& calibration = options.calibrate.calibration;
    for (const std::string& text : arguments.balls) calibration.balls.push_back(parse_ball(text));
    if (!arguments.ball_mask.empty()) options.calibrate.ball_mask = arguments.ball_mask;
    if (!arguments.from.empty()) options.calibrate.from = arguments.from;
    for (const std::string& text : arguments.highlights) calibration.highlights.push_back(parse_highlight(text));
    if (!arguments.grey_card.empty()) options.calibrate.grey_card = parse_grey_card(arguments.grey_card);
    if (!arguments.grey_card_mask.empty()) options.calibrate.grey_card_mask = arguments.grey_card_mask;
    return options;
}

/// Nothing that a person made goes without a word.
std::string what_went(const std::vector<std::string>& folders, const char* made_with) {
    if (folders.empty()) return {};
    return fmt::format("\nremoved, as made with other {}: {}", made_with, fmt::join(folders, ", "));
}

std::string describe(const CalibrateSummary& summary) {
    const Calibration& c = summary.calibration;
    const auto used = std::count_if(c.lights.begin(), c.lights.end(), [](const Light& light) { return light.used; });
    std::string text = fmt::format("{} of {} lights read ({}), condition number {:.2f}", used, c.lights.size(),
                                   c.method, c.condition_number);
    const auto near = std::count_if(c.lights.begin(), c.lights.end(), [](const Light& light) { return light.near; });
    if (near > 0) text += fmt::format("\n{} lamps are near: their places are known in mm", near);
    for (const Ball& ball : c.balls)
        text += fmt::format("\nball at ({:.1f}, {:.1f}), radius {:.1f} px, confidence {:.2f}", ball.x, ball.y,
                            ball.radius, ball.confidence);
    return text + what_went(summary.removed, "lights");
}

std::string describe(const NormalsSummary& summary) {
    std::string text =
        fmt::format("{} pixels from {} photographs ({}), residual {:.4f} of full scale, {:.2f} s", summary.pixels,
                    summary.images, summary.solver, summary.residual_rms, summary.seconds.solve);
    if (summary.body != "lambert") text += fmt::format("\nthe material's body follows the law '{}'", summary.body);
    if (summary.gloss != "none") text += fmt::format("\nits gloss follows the law '{}'", summary.gloss);
    if (summary.intensity_origin == IntensityOrigin::estimated) text += "\nwith estimated lamp intensities";
    if (summary.mean_angular_error_deg)
        text += fmt::format("\nmean angular error against the truth that came with the pictures: {:.2f} degrees",
                            *summary.mean_angular_error_deg);
    return text + what_went(summary.removed, "normals");
}

std::string describe(const TexelsSummary& summary) {
    return fmt::format("{} texels explain {:.1f} % of the variance", summary.texels, 100 * summary.variance_explained);
}

std::string describe(const ShadeSummary& summary) {
    return fmt::format("shading maps of {} texels at {} levels from {} samples", summary.texels, summary.levels,
                       summary.samples);
}

std::string describe(const ReportSummary& summary) { return fmt::format("report: {}", summary.file.string()); }

std::vector<std::string> warnings_of(const CalibrateSummary& summary) { return summary.calibration.warnings; }
std::vector<std::string> warnings_of(const NormalsSummary& summary) { return summary.warnings; }
std::vector<std::string> warnings_of(const TexelsSummary&) { return {}; }
std::vector<std::string> warnings_of(const ShadeSummary&) { return {}; }
/// Those of the whole session are in the report; the stages that found them said them already.
std::vector<std::string> warnings_of(const ReportSummary&) { return {}; }

template <class Summary>
CommandResult result_of(const Summary& summary) {
    return {to_json(summary), describe(summary), warnings_of(summary)};
}

CommandResult result_of(const ProcessSummary& summary) {
    CommandResult result;
    result.json = to_json(summary);
    const auto append = [&result](const auto& stage) {
        result.text += (result.text.empty() ? "" : "\n") + describe(stage);
        for (const std::string& warning : warnings_of(stage)) result.warnings.push_back(warning);
    };
    append(summary.calibrate);
    append(summary.normals);
    append(summary.texels);
    append(summary.shade);
    append(summary.report);
    return result;
}

void add_calibrate_options(CLI::App& command, StageArguments& a) {
    CalibrationOptions& calibration = a.options.calibrate.calibration;
    command.add_option("--ball", a.balls, "A ball's outline, pixels: X,Y,R; once for each ball (else they are found)");
    command.add_option("--ball-mask", a.ball_mask, "Picture that is white on the ball or balls");
    command.add_option("--ball-diameter", calibration.ball_diameter_mm, "Of the mirror balls, mm: tells the scale");
    const std::map<std::string, LampModel> models{
        {"auto", LampModel::automatic}, {"distant", LampModel::distant}, {"near", LampModel::near}};
    command.add_option("--lamps", calibration.lamps, "near: lamps have places; distant: directions; auto: as known")
        ->transform(one_of(models));
    command.add_option("--drop", calibration.drop, "Frames to leave out");
    command.add_option("--highlight", a.highlights, "A highlight read by hand: FRAME=X,Y");
    command.add_option("--grey-card", a.grey_card,
                       "A diffuse grey card that faces the camera in the photographs, pixels: X,Y,WIDTH,HEIGHT");
    command.add_option("--grey-card-mask", a.grey_card_mask, "Picture that is white on the grey card, of any outline");
    command.add_flag("--photometric", a.options.calibrate.photometric,
                     "Refine the lights with the object's own diffuse pixels as well");
    command.add_option("--from", a.from, "Reuse the lights of this lights.json or session, lamp by lamp");
    command.add_flag_callback(
        "--any-rig", [&a] { a.options.calibrate.other_rig = OtherRig::compare; },
        "With --from: lamps without a common name are matched by their place");
    const std::map<std::string, CalibrationMethod> methods{{"refined", CalibrationMethod::refined},
                                                           {"brightest", CalibrationMethod::brightest}};
    command.add_option("--method", calibration.method, "refined, or brightest: the plain method of the thesis")
        ->transform(one_of(methods));
}

void add_normals_options(CLI::App& command, StageArguments& a) {
    std::map<std::string, Solver> solvers;
    for (const auto& [solver, text] : solver_names) solvers.emplace(text, solver);
    command
        .add_option("--solver", a.options.normals.stereo.solver,
                    "lsq: least squares over all lights; robust: leaves out shadows and highlights")
        ->transform(one_of(solvers));
    command.add_flag_callback(
        "--no-surface", [&a] { a.options.normals.surface = false; }, "Leave out height.exr and surface.ply");
    command.add_flag("--shadows", a.options.normals.shadows,
                     "With --solver robust: also results/shadows, what each photograph's samples were taken for");
    const std::map<std::string, IntensityChoice> choices{{"auto", IntensityChoice::automatic},
                                                         {"given", IntensityChoice::given},
                                                         {"estimate", IntensityChoice::estimate}};
    command
        .add_option("--intensities", a.options.normals.intensities,
                    "given: as calibrated; estimate: with the normals; auto: estimated where nothing is known of them "
                    "and the photographs clearly ask for it")
        ->transform(one_of(choices));
}

void add_texels_options(CLI::App& command, StageArguments& a) {
    TexelOptions& texels = a.options.texels;
    command.add_option("--albedo-clusters", texels.albedo_clusters, "k of the first step")->capture_default_str();
    command
        .add_option("--neighbourhood-clusters", texels.neighbourhood_clusters, "k of the second step, in each group")
        ->capture_default_str();
    command.add_option("--window", texels.window, "Side of the neighbourhood, pixels, odd")->capture_default_str();
    command.add_option("--min-pixels", texels.min_pixels, "Smaller texels join the one most like them")
        ->capture_default_str();
    command.add_option("--max-pixels", texels.max_pixels, "Larger texels are parted; 0: no limit")
        ->capture_default_str();
    command.add_option("--seed", texels.seed, "Of the random choices")->capture_default_str();
}

void add_shade_options(CLI::App& command, StageArguments& a) {
    command.add_option("--levels", a.options.shading.levels, "Levels of the rendering coefficient")
        ->capture_default_str();
}

/// Of the stages that can do with less.
void add_memory_option(CLI::App& command, StageArguments& a) {
    command
        .add_option("--memory-mib", a.options.normals.stereo.memory_mib,
                    "Memory for photographs and maps at a time, of normals, height and shading")
        ->capture_default_str();
}

ShadingBands shading_bands(const ProcessOptions& options) {
    ShadingBands bands;
    bands.memory_mib = options.normals.stereo.memory_mib;
    return bands;
}

/// A command over one session. `stage` takes (Session, ProcessOptions, WorkContext).
template <class Stage>
CLI::App& add_stage(CommandLine& line, const std::string& name, const std::string& description,
                    const std::shared_ptr<StageArguments>& a, Stage stage) {
    CLI::App& command =
        line.add(name, description, fmt::format("darkbox {} s", name), [a, stage](const WorkContext& work) {
            const Session session = Session::open(a->session);
            session.verify();
            return result_of(stage(session, options_of(*a), work));
        });
    command.add_option("session", a->session, "The session's folder")->required();
    return command;
}

}  // namespace

void add_stage_commands(CommandLine& line) {
    const auto a = std::make_shared<StageArguments>();
    add_calibrate_options(add_stage(line, "calibrate", "Read the light directions off the mirror ball", a,
                                    [](const Session& s, const ProcessOptions& o, const WorkContext& w) {
                                        return run_calibrate(s, o.calibrate, w);
                                    }),
                          *a);
    CLI::App& normals = add_stage(
        line, "normals", "Photometric stereo: normals and unshaded albedo", a,
        [](const Session& s, const ProcessOptions& o, const WorkContext& w) { return run_normals(s, o.normals, w); });
    add_memory_option(normals, *a);
    add_normals_options(normals, *a);
    add_texels_options(add_stage(line, "texels", "Cluster the unshaded picture into texels", a,
                                 [](const Session& s, const ProcessOptions& o, const WorkContext& w) {
                                     return run_texels(s, o.texels, w);
                                 }),
                       *a);
    CLI::App& shade = add_stage(line, "shade", "Shading maps: each texel's radiance against the light", a,
                                [](const Session& s, const ProcessOptions& o, const WorkContext& w) {
                                    return run_shade(s, o.shading, shading_bands(o), w);
                                });
    add_memory_option(shade, *a);
    add_shade_options(shade, *a);
    add_stage(line, "report", "Write the session's report.html", a,
              [](const Session& s, const ProcessOptions&, const WorkContext& w) { return run_report(s, w); });
    CLI::App& process =
        add_stage(line, "process", "All stages in order, then the report", a,
                  [](const Session& s, const ProcessOptions& o, const WorkContext& w) { return run_process(s, o, w); });
    add_memory_option(process, *a);
    add_calibrate_options(process, *a);
    add_normals_options(process, *a);
    add_texels_options(process, *a);
    add_shade_options(process, *a);
}

}  // namespace darkbox
