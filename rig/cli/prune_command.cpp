#include <fmt/format.h>

#include <memory>
#include <optional>

#include "acquisition/device/device_error.h"
#include "rig/cli/followed_job.h"
#include "rig/cli/rig_commands.h"
#include "rig/daemon/catalog.h"
#include "rig/daemon/client.h"
#include "rig/daemon/folder_lock.h"
#include "rig/daemon/retention.h"
#include "rig/daemon/session_folder.h"

namespace darkbox {
namespace {

namespace fs = std::filesystem;

struct PruneArguments {
    fs::path socket;
    fs::path folder;
    RetentionRules rules;
    std::vector<std::string> keep;
    bool dry_run = false;
    bool for_daemon = false;  ///< which holds the folder, and asked for this
};

Json to_json(const PruneReport& report, bool dry_run) {
    Json removed = Json::array();
    for (const RemovedSession& session : report.removed)
        removed.push_back({{"name", session.name}, {"created", session.created}, {"bytes", session.bytes}});
    return {{"dry_run", dry_run},
            {"removed", removed},
            {"bytes", report.bytes},
            {"kept", report.kept},
            {"unverified", report.unverified}};
}

/// The same for a report of this process and for one that darkboxd made.
CommandResult result_of(const Json& report) {
    CommandResult result;
    result.json = report;
    const bool dry_run = report.at("dry_run").get<bool>();
    for (const Json& session : report.at("removed"))
        result.text += fmt::format("{} {} of {}, {:.1f} MB\n", dry_run ? "would remove" : "removed",
                                   session.at("name").get<std::string>(), session.at("created").get<std::string>(),
                                   session.at("bytes").get<double>() / 1e6);
    for (const auto& [reason, count] : report.at("kept").items())
        result.text += fmt::format("kept {}: {}\n", count.get<std::size_t>(), reason);
    for (const Json& fault : report.at("unverified"))
        result.warnings.push_back("stays, for it is not proven good: " + fault.get<std::string>());
    result.text += fmt::format("{} {} sessions, {:.1f} MB", dry_run ? "would remove" : "removed",
                               report.at("removed").size(), report.at("bytes").get<double>() / 1e6);
    return result;
}

CommandResult prune_here(const PruneArguments& a, const WorkContext& work) {
    // A darkboxd that has the folder knows what its jobs wait for, and must be asked.
    std::optional<FolderLock> lock;
    if (!a.dry_run && !a.for_daemon && fs::is_directory(a.folder)) lock.emplace(a.folder / Catalog::own_folder_name);
    const PruneOptions options{.rules = a.rules, .dry_run = a.dry_run, .keep = {a.keep.begin(), a.keep.end()}};
    return result_of(to_json(prune_sessions(a.folder, options, work), a.dry_run));
}

CommandResult prune_through(const DaemonClient& client, const PruneArguments& a, const WorkContext& work) {
    const auto job = client.call("POST", "jobs", {{"kind", "prune"}, {"dry_run", a.dry_run}});
    const auto end = FollowedJob(client, job, work, "ask for it again").end();
    if (end.at("event") == "cancelled") throw Cancelled(end.at("detail"), end.at("hint"));
    if (end.at("event") != "done") throw DeviceError(end.at("detail"), end.at("hint"));
    return result_of(Json::parse(end.at("result").dump()));
}

CommandResult run(const PruneArguments& a, const WorkContext& work) {
    const bool rules = a.rules.keep_days > 0;
    if (a.folder.empty() != !rules)
        throw InputError("--folder and --keep-days go together",
                         "give both, or neither: then darkboxd prunes its own folder by [retention] of its rig.toml");
    if (rules) return prune_here(a, work);
    const DaemonClient client(a.socket.empty() ? default_socket() : a.socket);
    if (!client.answers())
        throw InputError(fmt::format("no darkboxd answers at {}", client.socket().string()),
                         "start it, or give --folder and --keep-days");
    return prune_through(client, a, work);
}

}  // namespace

void add_prune_command(CommandLine& line, CLI::App& sessions) {
    const auto a = std::make_shared<PruneArguments>();
    CLI::App& command = line.add(
        "prune", "Remove sessions that are old, proven good, and needed by no other",
        "darkbox sessions prune --dry-run\n  darkbox sessions prune --folder sessions --keep-days 90",
        [a](const WorkContext& work) { return run(*a, work); }, &sessions);
    command.add_flag("--dry-run", a->dry_run, "Say what would be removed, and remove nothing");
    command.add_option("--folder", a->folder, "Where the sessions lie; default: darkboxd's, by its [retention]");
    command.add_option("--keep-days", a->rules.keep_days, "Younger sessions stay")->check(CLI::Range(1, 36500));
    command.add_option("--keep-newest", a->rules.keep_newest, "As many of the newest stay")
        ->check(CLI::Range(0, 1000000));
    command.add_option("--free-gb", a->rules.free_gb, "Remove only while less is free on the disk, 1e9 bytes");
    command.add_option("--keep", a->keep, "A session that stays; once for each")->take_all();
    command.add_flag("--for-daemon", a->for_daemon)->group("");
    command.add_option("--socket", a->socket, "Where darkboxd listens");
}

}  // namespace darkbox
