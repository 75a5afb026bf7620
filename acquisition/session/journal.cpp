#include "acquisition/session/journal.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <string>
#include <vector>

#include "acquisition/device/device_error.h"
#include "acquisition/session/durable_file.h"
#include "acquisition/session/session_json.h"

namespace darkbox {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t largest_journal = std::size_t{256} << 20;

/// How much of the text is whole lines. Power loss may also leave a last line whose blocks were never written: zeros.
std::size_t whole_lines(std::string_view text) {
    const std::size_t newline = text.rfind('\n');
    if (newline == std::string_view::npos) return 0;
    const std::size_t previous = newline == 0 ? std::string_view::npos : text.rfind('\n', newline - 1);
    const std::size_t start = previous == std::string_view::npos ? 0 : previous + 1;
    const bool zeros = text.substr(start, newline - start).find('\0') != std::string_view::npos;
    return zeros ? start : newline + 1;
}

std::vector<std::string_view> split_lines(std::string_view text) {
    std::vector<std::string_view> lines;
    for (std::size_t end; (end = text.find('\n')) != std::string_view::npos; text.remove_prefix(end + 1))
        lines.push_back(text.substr(0, end));
    return lines;
}

fs::path journal_of(const fs::path& folder) { return plain_file_inside(folder, journal_name); }

std::string line_place(const fs::path& file, std::size_t number) {
    return fmt::format("{} line {}", file.string(), number);
}

std::string read_whole_lines(const fs::path& file) {
    std::string text = read_text(file, largest_journal);
    text.resize(whole_lines(text));
    if (text.empty())
        throw InputError(fmt::format("{} has no first line", file.string()),
                         "the capture stopped before anything was kept; start again with a new folder");
    return text;
}

}  // namespace

Journal::Journal(const fs::path& file, std::uint64_t size)
    : file_(file), fd_(::open(file.c_str(), O_WRONLY | O_APPEND | O_CLOEXEC | O_NOFOLLOW)), size_(size) {
    if (!fd_) throw_errno("open", file.string(), errno);
}

Journal Journal::create(const fs::path& folder, const SessionInfo& info) {
    const std::string head = journal_head(info) + "\n";
    const fs::path file = folder / journal_name;
    write_durably(file, bytes_of(head));
    return Journal(file, head.size());
}

Journal::Replay Journal::open(const fs::path& folder) {
    const fs::path file = journal_of(folder);
    const std::string text = read_whole_lines(file);
    const std::vector<std::string_view> lines = split_lines(text);
    Replay replay{Journal(file, text.size()), {}};
    replay.contents.info = parse_journal_head(line_place(file, 1), lines.front());
    for (std::size_t i = 1; i < lines.size(); ++i)
        replay.contents.apply(parse_journal_line(line_place(file, i + 1), lines[i]));
    replay.journal.cut_back();
    return replay;
}

SessionInfo Journal::read_head(const fs::path& folder) {
    const fs::path file = journal_of(folder);
    const std::string text = read_whole_lines(file);
    return parse_journal_head(line_place(file, 1), std::string_view(text).substr(0, text.find('\n')));
}

void Journal::append(const JournalEntry& entry) {
    const std::string line = journal_line(entry) + "\n";
    cut_back();
    try {
        write_line(line);
    } catch (...) {
        if (::ftruncate(fd_.get(), static_cast<off_t>(size_)) != 0) {
            // The next append or resume cuts it: a line without its newline does not count.
        }
        throw;
    }
    size_ += line.size();
}

void Journal::cut_back() const {
    if (::ftruncate(fd_.get(), static_cast<off_t>(size_)) != 0) throw_errno("ftruncate", file_.string(), errno);
}

void Journal::write_line(std::string_view line) const {
    write_all(fd_.get(), bytes_of(line), file_);
    if (::fdatasync(fd_.get()) != 0) throw_errno("fdatasync", file_.string(), errno);
}

}  // namespace darkbox
