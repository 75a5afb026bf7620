#pragma once

#include <cstdint>
#include <string>
#include <unordered_set>
#include <variant>
#include <vector>

#include "acquisition/session/session.h"

namespace darkbox {

/// A file below data/, as it was when it was acknowledged.
struct Payload {
    std::string name;  ///< relative to data/
    std::uint64_t size = 0;
    std::string sha256;
};

/// What one line of the journal acknowledges.
struct FrameEntry {
    FrameRecord record;
    std::uint64_t size = 0;
};
struct NoteEntry {
    std::string note;
};
/// The frame of this name is not the session's any more, and the name is free.
struct WithdrawnEntry {
    std::string file;
    std::string why;
};
using JournalEntry = std::variant<FrameEntry, Payload, SessionEvent, NoteEntry, WithdrawnEntry>;

/// All that a session holds and says. The writer builds it up entry by entry; resuming replays the journal into it.
struct SessionContents {
    SessionInfo info;
    std::vector<FrameRecord> frames;
    std::vector<SessionEvent> events;
    std::vector<Payload> payloads;  ///< frames and extras
    std::unordered_set<std::string> names;

    /// Throws InputError when the session has a payload of that name already, or has no frame to withdraw.
    void apply(const JournalEntry& entry);
    bool holds(const std::string& name) const { return names.contains(name); }

private:
    void add_payload(Payload payload);
    void withdraw(const std::string& file);
};

}  // namespace darkbox
