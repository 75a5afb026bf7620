#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace darkbox {

/// Writes a derived file so that a reader sees the old bytes or the new ones, never a part: a temporary name beside it,
/// flushed, renamed, folder flushed. Missing parent folders are made. Throws InputError that names the path and the
/// system's reason.
void write_file(const std::filesystem::path& path, std::span<const std::byte> bytes);
void write_file(const std::filesystem::path& path, std::string_view text);

/// The same for a file that is written piece by piece: it appears on commit(), and never if that is not reached.
/// Thread-compatible.
class AtomicFile {
public:
    explicit AtomicFile(std::filesystem::path path);
    AtomicFile(const AtomicFile&) = delete;
    AtomicFile& operator=(const AtomicFile&) = delete;
    ~AtomicFile();

    void write(std::span<const std::byte> bytes);
    void write(std::string_view text);
    /// The next write() goes there, `position` bytes from the start: for tables that come before what they count.
    void seek(std::uint64_t position);
    void commit();

private:
    class Descriptor;
    std::filesystem::path path_, part_;
    std::unique_ptr<Descriptor> file_;
};

/// Throws InputError when the file is missing, is not a regular file, or cannot be read.
std::vector<std::byte> read_file(const std::filesystem::path& path);
std::string read_text(const std::filesystem::path& path);

}  // namespace darkbox
