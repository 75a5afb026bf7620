#include <fmt/format.h>

#include <memory>

#include "acquisition/frame/error.h"
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

ExportFormat named_format(const std::string& format) {
    try {
        return export_format(format);
    } catch (const InputError& error) {
        throw UsageError(error.what(), error.hint());
    }
}

CommandResult export_to(const fs::path& folder, const std::string& format, const fs::path& out,
                        const WorkContext& work) {
    const ExportFormat wanted = named_format(format);
    require_outside_payload(out);
    export_session(Session::open(folder), wanted, out, work);
    CommandResult result;
    result.json = {{"format", format}, {"out", out.string()}};
    result.text = fmt::format("{}: written as {}", out.string(), format);
    return result;
}

struct Arguments {
    fs::path session;
    fs::path out;
    std::string format;
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
    CLI::App& command =
        take_session(line.add("export", "Write results for other programs", "darkbox export s --format ply --out s.ply",
                              [a](const WorkContext& work) { return export_to(a->session, a->format, a->out, work); }));
    command.add_option("--format", a->format, "lp, diligent, ptm, ptm-rgb, relight, relight-rgb or ply")->required();
    command.add_option("--out", a->out, "File or folder to write")->required();
}

}  // namespace darkbox
