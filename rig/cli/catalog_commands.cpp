#include <fmt/format.h>

#include <map>
#include <memory>
#include <optional>

#include "processing/pipeline/ball_focus.h"
#include "rig/cli/daemon_questions.h"
#include "rig/cli/rig_commands.h"
#include "rig/daemon/api_words.h"
#include "rig/daemon/folder_lock.h"
#include "rig/daemon/lamp_ageing.h"

namespace darkbox {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t everything = 1'000'000;

struct CatalogArguments {
    fs::path socket;
    fs::path folder;
    bool rebuild = false;
    std::uint64_t id = 0;
    std::string find;
};

std::string text(const Json& json, const char* key) { return json.value(key, std::string()); }

/// For the value of a query (RFC 3986, section 2.3).
std::string percent_encoded(const std::string& text) {
    constexpr std::string_view plain = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789-._~";
    std::string result;
    for (const char c : text)
        result +=
            plain.find(c) != plain.npos ? std::string(1, c) : fmt::format("%{:02X}", static_cast<unsigned char>(c));
    return result;
}

/// Page after page of a list, as one.
Json ask_for_all(const DaemonClient& client, const std::string& list, const std::string& query = "") {
    Json whole = ask(client, "GET", fmt::format("{}?limit=1000{}", list, query));
    for (std::string next = text(whole, "next"); !next.empty();) {
        const Json page = ask(client, "GET", fmt::format("{}?limit=1000&after={}{}", list, next, query));
        for (const Json& item : page.at(list)) whole.at(list).push_back(item);
        next = text(page, "next");
    }
    whole.erase("next");
    return whole;
}

/// The daemon to ask: none when a folder is named, or none answers.
std::optional<DaemonClient> daemon_of(const CatalogArguments& a) {
    if (!a.folder.empty()) return std::nullopt;
    const auto socket = a.socket.empty() ? known_socket() : std::optional(a.socket);
    if (!socket || !DaemonClient(*socket).answers()) return std::nullopt;
    return DaemonClient(*socket);
}

fs::path folder_of(const CatalogArguments& a) { return a.folder.empty() ? default_sessions_folder() : a.folder; }

Json describe(const SessionListing& session) {
    Json json{{"name", session.name},       {"state", name(session.state)}, {"object", session.object},
              {"created", session.created}, {"frames", session.frames},     {"problem", session.problem},
              {"retakes", session.retakes}};
    if (!session.record.inventory.empty()) json["inventory"] = session.record.inventory;
    if (!session.record.dublin_core.empty()) json["dublin_core"] = session.record.dublin_core;
    return json;
}

/// Read off the sessions themselves; nothing is written to their folder.
Json sessions_on_disk(const fs::path& folder, const std::string& find) {
    Catalog catalog(folder, Catalog::Place::in_memory);
    catalog.refresh();
    Json list = Json::array();
    for (const SessionListing& session : catalog.sessions({.limit = everything}, find))
        list.push_back(describe(session));
    return {{"folder", folder.string()}, {"sessions", list}};
}

CommandResult rebuild(const CatalogArguments& a) {
    CommandResult result;
    if (const auto client = daemon_of(a)) {
        result.json = ask(*client, "POST", "catalog/rebuild");
    } else {
        const fs::path folder = folder_of(a);
        if (!fs::is_directory(folder))
            throw InputError(fmt::format("there is no folder {}", folder.string()), "give --folder");
        const FolderLock lock(folder / Catalog::own_folder_name);
        Catalog catalog(folder);
        catalog.rebuild();
        result.json = {{"sessions", catalog.session_count()}};
    }
    result.text = fmt::format("read again: {} sessions", result.json.at("sessions").get<std::size_t>());
    return result;
}

CommandResult sessions(const CatalogArguments& a) {
    if (a.rebuild) return rebuild(a);
    CommandResult result;
    const auto client = daemon_of(a);
    result.json = client ? ask_for_all(*client, "sessions", a.find.empty() ? "" : "&find=" + percent_encoded(a.find))
                         : sessions_on_disk(folder_of(a), a.find);
    for (const Json& session : result.json.at("sessions")) {
        result.text += fmt::format("{:<40} {:<12} {:>4} frames  {:<22} {:<12} {}", text(session, "name"),
                                   text(session, "state"), session.at("frames").get<int>(), text(session, "created"),
                                   text(session, "inventory"), text(session, "object"));
        const std::string retakes = text(session, "retakes");
        result.text += retakes.empty() ? "\n" : fmt::format(", retakes {}\n", retakes);
        if (const std::string problem = text(session, "problem"); !problem.empty())
            result.warnings.push_back(fmt::format("{}: {}", text(session, "name"), problem));
    }
    if (result.text.empty())
        result.text = fmt::format("no sessions {}in {}\n", a.find.empty() ? "" : "with these words ",
                                  text(result.json, "folder"));
    result.text.pop_back();
    return result;
}

/// Read off the sessions themselves; nothing is written to their folder.
Json calibrations_on_disk(const fs::path& folder) {
    Catalog catalog(folder, Catalog::Place::in_memory);
    catalog.refresh();
    Json list = Json::array();
    for (const CatalogCalibration& calibration : catalog.calibrations({.limit = everything})) {
        Json entry = Json::parse(to_json(calibration).dump());
        if (const auto blur = stored_blur_px(folder / calibration.session)) entry["blur_px"] = *blur;
        entry["drift"] = Json::array();
        for (const CatalogDrift& drift : catalog.drifts(calibration.session))
            entry["drift"].push_back(Json::parse(to_json(drift).dump()));
        list.push_back(std::move(entry));
    }
    return {{"calibrations", list}};
}

std::string since(const Json& calibration, const std::string& role, std::vector<std::string>& alarms) {
    for (const Json& drift : calibration.at("drift")) {
        if (text(drift, "role") != role) continue;
        const std::string alarm = text(drift, "alarm");
        if (!alarm.empty() && role == "last")
            alarms.push_back(
                fmt::format("{} since {}: {}", text(calibration, "session"), text(drift, "against"), alarm));
        if (!alarm.empty()) return "alarm";
        return drift.at("steady").get<bool>() ? "steady" : "drifts";
    }
    return "-";
}

/// How the blur at the ball of each rig changes over its calibrations.
void tell_focus(CommandResult& result) {
    std::map<std::string, std::vector<LampAgeing::Reading>> of_rigs;
    for (const Json& c : result.json.at("calibrations"))
        if (const auto day = day_of_date(text(c, "created")); day && c.contains("blur_px"))
            of_rigs[text(c, "rig")].push_back({*day, c.at("blur_px").get<double>()});
    result.json["focus"] = Json::array();
    for (auto& [rig, readings] : of_rigs) {
        const auto trend = trend_of(rig, std::move(readings));
        if (!trend) continue;
        result.json["focus"].push_back({{"rig", rig},
                                        {"readings", trend->readings.size()},
                                        {"blur_percent_per_month", trend->percent_per_month},
                                        {"sigma", trend->sigma},
                                        {"blur_ratio", trend->left}});
        result.text +=
            fmt::format("focus of {}: the blur changed by {:+.1f} % over {} calibrations, {:+.2f} ± {:.2f} % a month\n",
                        rig, (trend->left - 1) * 100, trend->readings.size(), trend->percent_per_month, trend->sigma);
    }
}

CommandResult calibrations(const CatalogArguments& a) {
    CommandResult result;
    const auto client = daemon_of(a);
    result.json = client ? ask_for_all(*client, "calibrations") : calibrations_on_disk(folder_of(a));
    result.text = fmt::format("{:<36} {:<25} {:>9} {:>9} {:>8} {:>8}  {:<8} {}\n", "session", "made", "lamps",
                              "condition", "sigma °", "blur px", "last", "first");
    for (const Json& c : result.json.at("calibrations")) {
        const std::string used = fmt::format("{}/{}", c.at("used").get<int>(), c.at("lamps").get<int>());
        const std::string last = since(c, "last", result.warnings);
        const std::string blur = c.contains("blur_px") ? fmt::format("{:.2f}", c.at("blur_px").get<double>()) : "-";
        result.text += fmt::format("{:<36} {:<25} {:>9} {:>9.2f} {:>8.3f} {:>8}  {:<8} {}\n", text(c, "session"),
                                   text(c, "created"), used, c.at("condition_number").get<double>(),
                                   c.at("sigma_deg").get<double>(), blur, last, since(c, "first", result.warnings));
    }
    if (result.json.at("calibrations").empty()) result.text = "no calibrations\n";
    tell_focus(result);
    result.text.pop_back();
    return result;
}

CommandResult jobs(const CatalogArguments& a) {
    CommandResult result;
    result.json = ask(client_at(a.socket), "GET", "jobs");
    for (const Json& job : result.json.at("jobs")) {
        const Json& progress = job.at("progress");
        result.text +=
            fmt::format("{:>6} {:<12} {:<10} {:<36} {}/{} {}\n", job.at("id").get<std::uint64_t>(), text(job, "kind"),
                        text(job, "state"), text(job, "session"), progress.at("done").get<std::size_t>(),
                        progress.at("total").get<std::size_t>(), text(job, "detail"));
    }
    if (result.text.empty()) result.text = "no jobs yet\n";
    result.text.pop_back();
    return result;
}

CommandResult cancel_job(const CatalogArguments& a) {
    CommandResult result;
    result.json = ask(client_at(a.socket), "DELETE", fmt::format("jobs/{}", a.id));
    result.text = fmt::format("job {} is {}", a.id, text(result.json, "state"));
    return result;
}

using CatalogRun = CommandResult (*)(const CatalogArguments&);

struct CatalogCommand {
    CLI::App& command;
    std::shared_ptr<CatalogArguments> arguments;
};

CatalogCommand add_catalog_command(CommandLine& line, const char* name, const char* description, const char* example,
                                   CatalogRun run, CLI::App* group = nullptr) {
    const auto a = std::make_shared<CatalogArguments>();
    CLI::App& command = line.add(name, description, example, [a, run](const WorkContext&) { return run(*a); }, group);
    command.add_option("--socket", a->socket, "Where darkboxd listens");
    return {command, a};
}

void take_folder(const CatalogCommand& added) {
    added.command.add_option(
        "--folder", added.arguments->folder,
        "Where the sessions lie; default: darkboxd's folder when it runs, else $DARKBOX_SESSIONS, or ./sessions");
}

}  // namespace

void add_catalog_commands(CommandLine& line) {
    const CatalogCommand list = add_catalog_command(line, "sessions", "The captured sessions",
                                                    "darkbox sessions --find \"vase 1907\"", sessions);
    take_folder(list);
    list.command.add_option("--find", list.arguments->find,
                            "Only sessions with all of these words in name, object, inventory number or Dublin Core");
    list.command.add_flag("--rebuild", list.arguments->rebuild, "Make the catalogue again from what is on disk");
    add_prune_command(line, list.command);
    take_folder(add_catalog_command(line, "calibrations",
                                    "Every calibration, and what moved since the last and the first one",
                                    "darkbox calibrations", calibrations));

    CLI::App& group = line.add_group("jobs", "What darkboxd was asked to do");
    add_catalog_command(line, "list", "The last hundred, newest first", "darkbox jobs list", jobs, &group);
    const CatalogCommand cancel =
        add_catalog_command(line, "cancel", "Ask a job to stop", "darkbox jobs cancel 12", cancel_job, &group);
    cancel.command.add_option("id", cancel.arguments->id, "The job's number")->required();
}

}  // namespace darkbox
