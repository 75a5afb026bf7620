#include <fmt/format.h>

#include <memory>

#include "processing/pipeline/evaluate.h"
#include "processing/pipeline/export.h"
#include "rig/cli/arguments.h"
#include "rig/cli/commands.h"

namespace darkbox {
namespace {

namespace fs = std::filesystem;

CommandResult verify(const fs::path& folder) {
    const Session session = Session::open(folder);
    session.verify();
    CommandResult result;
    std::size_t unverified = 0;
    for (const FrameRecord& frame : session.frames())
        unverified += session.info().source == "capture" && !frame.verified;
    if (unverified > 0)
        result.warnings.push_back(fmt::format("{} frames were not verified to be lit by their lamp", unverified));
    result.json = {{"session", folder.string()}, {"frames", session.frames().size()}, {"complete", true}};
    result.text = fmt::format("{}: {} frames, every checksum fits", folder.string(), session.frames().size());
    return result;
}

Json to_json(const AngularError& error) {
    return {{"mean_deg", error.mean_deg},
            {"median_deg", error.median_deg},
            {"p95_deg", error.p95_deg},
            {"count", error.count}};
}

CommandResult evaluate(const fs::path& folder, const std::optional<fs::path>& lights, const WorkContext& work) {
    const Evaluation evaluation = evaluate_session(Session::open(folder), lights, work);
    CommandResult result;
    if (evaluation.normals) {
        result.json["mean_angular_error_deg"] = evaluation.normals->mean_deg;
        result.json["normals"] = to_json(*evaluation.normals);
        result.text = fmt::format("normals: mean {:.3f}, median {:.3f}, 95th percentile {:.3f} degrees over {} pixels",
                                  evaluation.normals->mean_deg, evaluation.normals->median_deg,
                                  evaluation.normals->p95_deg, evaluation.normals->count);
    }
    if (evaluation.lights) {
        result.json["lights"] = to_json(*evaluation.lights);
        result.text +=
            fmt::format("{}lights: mean {:.3f}, median {:.3f}, 95th percentile {:.3f} degrees over {} lights",
                        result.text.empty() ? "" : "\n", evaluation.lights->mean_deg, evaluation.lights->median_deg,
                        evaluation.lights->p95_deg, evaluation.lights->count);
    }
    return result;
}

CommandResult export_to(const fs::path& folder, const std::string& format, const fs::path& out,
                        const WorkContext& work) {
    require_outside_payload(out);
    export_session(Session::open(folder), export_format(format), out, work);
    CommandResult result;
    result.json = {{"format", format}, {"out", out.string()}};
    result.text = fmt::format("{}: written as {}", out.string(), format);
    return result;
}

struct Arguments {
    fs::path session;
    fs::path out;
    std::string format;
    std::optional<fs::path> lights;
};

}  // namespace

void add_session_commands(CommandLine& line) {
    const auto a = std::make_shared<Arguments>();
    const auto take_session = [&a](CLI::App& command) -> CLI::App& {
        command.add_option("session", a->session, "The session's folder")->required();
        return command;
    };
    take_session(line.add("verify", "Check a session's checksums and completeness", "darkbox verify s",
                          [a](const WorkContext&) { return verify(a->session); }));
    CLI::App& evaluate_command = take_session(
        line.add("evaluate", "Angular errors, where the truth is known", "darkbox evaluate s --lights true.lp",
                 [a](const WorkContext& work) { return evaluate(a->session, a->lights, work); }));
    evaluate_command.add_option("--lights", a->lights, "True light directions, in the frames' order");
    CLI::App& command =
        take_session(line.add("export", "Write results for other programs", "darkbox export s --format ply --out s.ply",
                              [a](const WorkContext& work) { return export_to(a->session, a->format, a->out, work); }));
    command.add_option("--format", a->format, "lp, diligent or ply")->required();
    command.add_option("--out", a->out, "File or folder to write")->required();
}

}  // namespace darkbox
