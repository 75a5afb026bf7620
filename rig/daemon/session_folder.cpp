#include "rig/daemon/session_folder.h"

#include <fmt/chrono.h>
#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>
#include <iterator>

#include "acquisition/frame/error.h"
#include "acquisition/session/bag.h"
#include "acquisition/session/journal.h"
#include "acquisition/session/session.h"

namespace darkbox {
namespace {

namespace fs = std::filesystem;
using State = SessionListing::State;

constexpr std::size_t longest_name = 100;
constexpr std::size_t longest_slug = 60;

bool is_plain(char c) { return (c >= 'A' && c <= 'Z') || (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9'); }

bool is_session_name(const std::string& name) {
    const auto allowed = [](char c) { return is_plain(c) || c == '.' || c == '_' || c == '-'; };
    return !name.empty() && name.size() <= longest_name && name.front() != '.' && std::ranges::all_of(name, allowed);
}

/// The object's name with everything but letters and digits turned into single hyphens.
std::string slug(const std::string& object) {
    std::string result;
    for (const char c : object) {
        if (is_plain(c))
            result += c;
        else if (!result.empty() && result.back() != '-')
            result += '-';
    }
    result.resize(std::min(result.size(), longest_slug));
    while (!result.empty() && result.back() == '-') result.pop_back();
    return result.empty() ? "session" : result;
}

std::size_t files_in(const fs::path& folder) {
    if (!fs::is_directory(folder)) return 0;
    return static_cast<std::size_t>(std::distance(fs::directory_iterator(folder), fs::directory_iterator()));
}

SessionListing describe_sealed(const fs::path& folder) {
    SessionListing listing{.name = folder.filename().string()};
    try {
        const Session session = Session::open(folder);
        listing.object = session.info().object;
        listing.record = session.info().record;
        listing.created = session.info().created;
        listing.frames = session.frames().size();
        if (session.info().retakes) listing.retakes = session.info().retakes->name;
    } catch (const Error& error) {
        // One damaged session must not hide the others.
        listing.state = State::damaged;
        listing.problem = error.what();
    }
    return listing;
}

SessionListing describe_interrupted(const fs::path& folder) {
    SessionListing listing{.name = folder.filename().string(), .state = State::interrupted};
    try {
        const SessionInfo info = Journal::read_head(folder);
        listing.object = info.object;
        listing.record = info.record;
        listing.created = info.created;
        if (info.retakes) listing.retakes = info.retakes->name;
        listing.frames = files_in(folder / "data" / "frames");
    } catch (const Error& error) {
        listing.state = State::damaged;
        listing.problem = error.what();
    }
    return listing;
}

}  // namespace

std::string name(State state) {
    switch (state) {
        case State::sealed:
            return "sealed";
        case State::interrupted:
            return "interrupted";
        case State::damaged:
            break;
    }
    return "damaged";
}

State session_state_from_name(const std::string& text) {
    for (const State state : {State::sealed, State::interrupted})
        if (name(state) == text) return state;
    return State::damaged;
}

std::optional<SessionListing> describe_session(const fs::path& folder) {
    if (!is_session_name(folder.filename().string())) return std::nullopt;
    if (is_sealed(folder)) return describe_sealed(folder);
    if (fs::exists(folder / journal_name)) return describe_interrupted(folder);
    return std::nullopt;
}

std::vector<std::string> session_names(const fs::path& folder) {
    std::vector<std::string> names;
    if (!fs::is_directory(folder)) return names;
    for (const fs::directory_entry& entry : fs::directory_iterator(folder)) {
        std::string name = entry.path().filename().string();
        if (is_session_name(name) && entry.symlink_status().type() == fs::file_type::directory)
            names.push_back(std::move(name));
    }
    std::ranges::sort(names);
    return names;
}

fs::path session_path(const fs::path& folder, const std::string& name) {
    if (!is_session_name(name))
        throw InputError(fmt::format("\"{}\" is not the name of a session", name.substr(0, longest_name)),
                         fmt::format("use 1 to {} letters, digits, dots, hyphens and underscores, no dot at the start",
                                     longest_name));
    return folder / name;
}

std::string fresh_session_name(const fs::path& folder, const std::string& object,
                               std::chrono::system_clock::time_point now) {
    const std::time_t seconds = std::chrono::system_clock::to_time_t(now);
    const std::string base = fmt::format("{}-{:%Y%m%d-%H%M%S}", slug(object), fmt::gmtime(seconds));
    std::string name = base;
    for (int n = 2; fs::exists(folder / name); ++n) name = fmt::format("{}-{}", base, n);
    return name;
}

fs::path default_sessions_folder() {
    const char* given = std::getenv("DARKBOX_SESSIONS");
    return given != nullptr && *given != '\0' ? fs::path(given) : fs::path("sessions");
}

}  // namespace darkbox
