#pragma once

#include <cstdint>
#include <filesystem>
#include <string_view>

#include "acquisition/device/unique_fd.h"
#include "acquisition/session/session_contents.h"

namespace darkbox {

inline constexpr std::string_view journal_name = "journal.jsonl";

/// SESSION/journal.jsonl: the session's head, then a line for everything acknowledged. A line counts once it ends in a
/// newline; what a crash leaves after the last newline was never acknowledged. Thread-compatible.
class Journal {
public:
    /// A new journal that holds the head. Throws DeviceError.
    static Journal create(const std::filesystem::path& folder, const SessionInfo& info);

    struct Replay;
    /// Reads an existing journal and cuts a torn last line off its file. Throws InputError that names the damaged line.
    static Replay open(const std::filesystem::path& folder);

    /// The head alone, nothing changed on disk.
    static SessionInfo read_head(const std::filesystem::path& folder);

    /// Flushed when it returns. When it throws, the line is not in the journal and it may be tried again.
    void append(const JournalEntry& entry);

private:
    Journal(const std::filesystem::path& file, std::uint64_t size);
    void cut_back() const;
    void write_line(std::string_view line) const;

    std::filesystem::path file_;
    UniqueFd fd_;
    std::uint64_t size_ = 0;  ///< bytes of whole lines
};

struct Journal::Replay {
    Journal journal;
    SessionContents contents;
};

}  // namespace darkbox
