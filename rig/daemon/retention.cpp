#include "rig/daemon/retention.h"

#include <fmt/chrono.h>
#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <ranges>

#include "acquisition/device/device_error.h"
#include "acquisition/frame/error.h"
#include "acquisition/session/bag.h"
#include "acquisition/session/durable_file.h"
#include "acquisition/session/journal.h"
#include "acquisition/session/session.h"
#include "rig/daemon/catalog.h"

namespace darkbox {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

constexpr std::size_t everything = 1'000'000;
constexpr std::size_t largest_document = std::size_t{64} << 20;
constexpr double bytes_per_gb = 1e9;

/// Compares as text with the times in sessions.
std::string iso8601(std::chrono::system_clock::time_point time) {
    return fmt::format("{:%Y-%m-%dT%H:%M:%S}", fmt::gmtime(std::chrono::system_clock::to_time_t(time)));
}

bool is_moment(const std::string& text) {
    constexpr std::string_view form = "dddd-dd-ddTdd:dd:dd";
    return text.size() >= form.size() &&
           std::ranges::equal(form, text.substr(0, form.size()), [](char want, char have) {
               return want == 'd' ? have >= '0' && have <= '9' : have == want;
           });
}

/// Every text under a key "session", however deep.
void add_references(const Json& json, std::set<std::string>& names) {
    if (!json.is_structured()) return;
    for (const auto& [key, value] : json.items()) {
        if (key == "session" && value.is_string()) names.insert(value.get<std::string>());
        add_references(value, names);
    }
}

/// The text that holds what a session says of itself: its document, or the first line of its journal.
std::string own_words(const fs::path& session) {
    if (is_sealed(session)) return read_text(session / "data" / session_file_name, largest_document);
    std::string journal = read_text(session / journal_name, largest_document);
    journal.resize(std::min(journal.find('\n'), journal.size()));
    return journal;
}

/// By the name of a session: one that refers to it. What cannot be read refers to nothing that could be known.
std::map<std::string, std::string> referrers(const fs::path& folder, const std::vector<SessionListing>& sessions) {
    std::map<std::string, std::string> found;
    for (const SessionListing& session : sessions) {
        std::set<std::string> names;
        try {
            const Json json = Json::parse(own_words(folder / session.name), nullptr, false);
            if (json.is_object() && json.contains("session")) add_references(json.at("session"), names);
        } catch (const Error&) {
            continue;
        }
        for (const std::string& name : names)
            if (name != session.name) found.emplace(name, session.name);
    }
    return found;
}

/// The first and the last calibration of every rig.
std::set<std::string> calibrations_to_keep(const Catalog& catalog) {
    std::map<std::string, std::pair<std::string, std::string>> ends;
    for (const CatalogCalibration& calibration : catalog.calibrations({.limit = everything})) {
        const auto [place, fresh] = ends.try_emplace(calibration.rig, calibration.session, calibration.session);
        if (!fresh) place->second.second = calibration.session;
    }
    std::set<std::string> names;
    for (const auto& entry : ends) names.insert({entry.second.first, entry.second.second});
    return names;
}

std::uint64_t bytes_of(const fs::path& session) {
    std::uint64_t bytes = 0;
    for (const std::string& file : files_below(session)) {
        std::error_code ignored;
        const auto size = fs::file_size(session / file, ignored);
        if (!ignored) bytes += size;
    }
    return bytes;
}

std::uint64_t free_on_disk(const fs::path& folder) {
    std::error_code error;
    const auto space = fs::space(folder, error);
    if (error) throw_errno("statvfs", folder.string(), error.value());
    return space.available;
}

/// Why it is not proven good; empty for one that is.
std::string fault_of(const fs::path& folder) {
    try {
        const Session session = Session::open(folder);
        const auto bad = std::ranges::find(session.frames(), false, &FrameRecord::verified);
        if (bad != session.frames().end()) return bad->file + " was not verified when it was taken";
        session.verify();
        return "";
    } catch (const Error& error) {
        return error.what();
    }
}

class Pruning {
public:
    Pruning(const fs::path& folder, const PruneOptions& options, const WorkContext& work)
        : folder_(folder), options_(options), work_(work), catalog_(folder, Catalog::Place::in_memory) {}

    PruneReport run() {
        catalog_.refresh();
        std::vector<SessionListing> sessions = catalog_.sessions({.limit = everything});
        std::ranges::stable_sort(sessions, {}, &SessionListing::created);
        referrers_ = referrers(folder_, sessions);
        calibrations_ = calibrations_to_keep(catalog_);
        cutoff_ = iso8601(options_.now - std::chrono::hours(24) * options_.rules.keep_days);
        const std::size_t newest = std::min(static_cast<std::size_t>(options_.rules.keep_newest), sessions.size());
        if (!options_.dry_run) finish_removing();
        for (std::size_t i = 0; i < sessions.size(); ++i) {
            if (work_.cancelled()) throw Cancelled("pruning was cancelled", "what was removed by then is gone");
            work_.tell({"pruning", i, sessions.size(), sessions[i].name});
            const bool among_newest = i + newest >= sessions.size();
            if (const std::string reason = reason_to_keep(sessions[i], among_newest); !reason.empty())
                ++report_.kept[reason];
            else
                remove_if_good(sessions[i]);
        }
        return std::move(report_);
    }

private:
    std::string reason_to_keep(const SessionListing& session, bool among_newest) const {
        if (session.state != SessionListing::State::sealed) return darkbox::name(session.state);
        if (!is_moment(session.created)) return "it does not say when it was made";
        if (session.created >= cutoff_) return fmt::format("younger than {} days", options_.rules.keep_days);
        if (among_newest) return fmt::format("among the newest {}", options_.rules.keep_newest);
        if (options_.keep.contains(session.name)) return "a job waits for it";
        if (referrers_.contains(session.name)) return "another session refers to it";
        if (calibrations_.contains(session.name)) return "the first or last calibration of its rig";
        if (enough_is_free()) return "enough of the disk is free";
        return Session::open(folder_ / session.name).info().source == "capture" ? "" : "it was imported";
    }

    /// With what a dry run would have freed.
    bool enough_is_free() const {
        if (!options_.rules.free_gb) return false;
        const auto free = (options_.free_bytes ? options_.free_bytes : free_on_disk)(folder_);
        const auto freed = options_.dry_run ? report_.bytes : 0;
        return static_cast<double>(free + freed) >= *options_.rules.free_gb * bytes_per_gb;
    }

    void remove_if_good(const SessionListing& session) {
        const fs::path place = folder_ / session.name;
        if (const std::string fault = fault_of(place); !fault.empty()) {
            report_.unverified.push_back(fmt::format("{}: {}", session.name, fault));
            return;
        }
        const std::uint64_t bytes = bytes_of(place);
        if (!options_.dry_run) remove(place);
        report_.removed.push_back({session.name, session.created, bytes});
        report_.bytes += bytes;
    }

    /// By a rename out of sight first: a session is there as a whole or not at all.
    void remove(const fs::path& session) {
        make_folder_durably(out_of_sight());
        std::error_code error;
        fs::rename(session, out_of_sight() / session.filename(), error);
        if (error) throw_errno("rename", session.string(), error.value());
        flush_folder(folder_);
        finish_removing();
    }

    /// Also what an earlier run had no time for.
    void finish_removing() {
        std::error_code error;
        fs::remove_all(out_of_sight(), error);
        if (error) throw_errno("remove", out_of_sight().string(), error.value());
    }

    fs::path out_of_sight() const { return folder_ / Catalog::own_folder_name / "removed"; }

    const fs::path folder_;
    const PruneOptions& options_;
    const WorkContext& work_;
    Catalog catalog_;
    std::map<std::string, std::string> referrers_;
    std::set<std::string> calibrations_;
    std::string cutoff_;
    PruneReport report_;
};

}  // namespace

PruneReport prune_sessions(const fs::path& folder, const PruneOptions& options, const WorkContext& work) {
    if (options.rules.keep_days < 1)
        throw InputError(fmt::format("keep_days is {}; allowed: 1 or more", options.rules.keep_days),
                         "say for how many days sessions stay at least");
    if (options.rules.keep_newest < 0)
        throw InputError(fmt::format("keep_newest is {}; allowed: 0 or more", options.rules.keep_newest),
                         "leave it out");
    if (!fs::is_directory(folder))
        throw InputError(fmt::format("there is no folder {}", folder.string()), "give --folder");
    return Pruning(folder, options, work).run();
}

}  // namespace darkbox
