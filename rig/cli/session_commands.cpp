#include <fmt/format.h>

#include <memory>

#include "acquisition/frame/error.h"
#include "acquisition/session/bag.h"
#include "processing/pipeline/export.h"
#include "rig/cli/arguments.h"
#include "rig/cli/commands.h"

namespace darkbox {
namespace {

namespace fs = std::filesystem;

/// What became of the session that another one refers to; it is looked for in the same folder.
struct Referred {
    bool found = false;
    bool unchanged = false;
};

Referred look_up(const Session& session, const SessionReference& old) {
    const fs::path plain = session.folder().has_filename() ? session.folder() : session.folder().parent_path();
    const fs::path there = fs::absolute(plain).parent_path() / old.name;
    if (!is_sealed(there)) return {};
    try {
        return {.found = true, .unchanged = Session::open(there).reference() == old};
    } catch (const Error&) {  // damaged: not as it was, and no fault of the session that refers to it
        return {.found = true, .unchanged = false};
    }
}

/// Says under `key` and in words what `frames` of the session were taken over from, and warns where that is another by
/// now.
void add_origin(CommandResult& result, const Session& session, const char* key, const SessionReference& old,
                const std::string& frames) {
    const Referred referred = look_up(session, old);
    result.json[key] = {{"session", old.name}, {"found", referred.found}, {"unchanged", referred.unchanged}};
    result.text += fmt::format("; {} taken over from {}, which {}", frames, old.name,
                               !referred.found       ? "is not beside it"
                               : !referred.unchanged ? "is beside it, but holds something else by now"
                                                     : "is beside it as it was");
    if (referred.found && !referred.unchanged)
        result.warnings.push_back(
            fmt::format("{} is not the session that {} refers to", old.name, session.folder().string()));
}

CommandResult verify(const fs::path& folder) {
    const Session session = Session::open(folder);
    session.verify();
    CommandResult result;
    std::size_t unverified = 0, taken_over = 0, flats = 0;
    for (const FrameRecord& frame : session.frames()) {
        unverified += session.info().source == "capture" && !frame.verified;
        if (frame.taken_over_from.empty()) continue;
        ++(frame.file.starts_with("frames/flat/") ? flats : taken_over);
    }
    if (unverified > 0)
        result.warnings.push_back(fmt::format("{} frames were not verified to be lit by their lamp", unverified));
    result.json = {{"session", folder.string()}, {"frames", session.frames().size()}, {"complete", true}};
    result.text = fmt::format("{}: {} frames, every checksum fits", folder.string(), session.frames().size());
    const SessionInfo& info = session.info();
    if (info.retakes) add_origin(result, session, "retakes", *info.retakes, fmt::format("{} of them", taken_over));
    if (info.flats) add_origin(result, session, "flats", *info.flats, fmt::format("{} of a card", flats));
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

struct SessionArguments {
    fs::path session;
    fs::path out;
    std::string format;
};

}  // namespace

void add_session_commands(CommandLine& line) {
    const auto a = std::make_shared<SessionArguments>();
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
