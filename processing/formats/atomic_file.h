#pragma once

#include <cstddef>
#include <filesystem>
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

/// Throws InputError when the file is missing, is not a regular file, or cannot be read.
std::vector<std::byte> read_file(const std::filesystem::path& path);
std::string read_text(const std::filesystem::path& path);

}  // namespace darkbox
