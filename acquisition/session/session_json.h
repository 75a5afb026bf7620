#pragma once

#include <string>
#include <string_view>

#include "acquisition/session/session_contents.h"

namespace darkbox {

/// What to do about a session that is not as darkbox left it.
inline constexpr const char* damaged_hint =
    "the session is damaged or was not written by darkbox; take it from a backup";

/// The text forms of a session: the lines of its journal (each without its newline) and session.json. The readers
/// throw one InputError that begins with `where` for whatever is wrong: syntax, nesting, types, ranges, names.

std::string journal_head(const SessionInfo& info);
std::string journal_line(const JournalEntry& entry);
std::string session_document(const SessionContents& contents);

SessionInfo parse_journal_head(const std::string& where, std::string_view line);
JournalEntry parse_journal_line(const std::string& where, std::string_view line);

struct SessionDocument {
    SessionInfo info;
    std::vector<FrameRecord> frames;
    std::vector<SessionEvent> events;
};
SessionDocument parse_session_document(const std::string& where, std::string_view text);

}  // namespace darkbox
