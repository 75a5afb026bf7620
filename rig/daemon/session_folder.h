#pragma once

#include <chrono>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "acquisition/session/object_record.h"

namespace darkbox {

/// The folder that holds a rig's sessions, one folder each.
struct SessionListing {
    enum class State {
        sealed,
        interrupted,  ///< has a journal: resumes
        damaged,      ///< looks like a session, but does not open
    };
    std::string name = {};  ///< of its folder
    State state = State::sealed;
    std::string object = {};
    ObjectRecord record = {};
    std::string created = {};  ///< ISO 8601, UTC
    std::size_t frames = 0;
    std::string problem = {};  ///< of a damaged one, in words
    std::string retakes = {};  ///< the session of which this one takes lamps again; empty: none
};

std::string name(SessionListing::State state);
/// And back; anything unknown is `damaged`.
SessionListing::State session_state_from_name(const std::string& name);

/// The names of the folder's entries that may be sessions, sorted; folders only, links are not followed.
std::vector<std::string> session_names(const std::filesystem::path& folder);

/// No value when the folder is no session. Never throws for a damaged one.
std::optional<SessionListing> describe_session(const std::filesystem::path& session);

/// The path of the session of this name. A name is 1 to 100 of A-Z a-z 0-9 . _ - and does not start with a dot, so it
/// cannot leave the folder; anything else is an InputError.
std::filesystem::path session_path(const std::filesystem::path& folder, const std::string& name);

/// "vase-20261123-132854": the object's letters and digits and the moment, UTC; with "-2" and so on when that is taken.
std::string fresh_session_name(const std::filesystem::path& folder, const std::string& object,
                               std::chrono::system_clock::time_point now);

/// $DARKBOX_SESSIONS, or ./sessions.
std::filesystem::path default_sessions_folder();

}  // namespace darkbox
