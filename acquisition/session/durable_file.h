#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>

namespace darkbox {

/// Files that are there whole or not at all, also after power loss. Every function throws DeviceError with the call,
/// the path and the reason when the operating system refuses, unless it says otherwise.

/// The name under which a file is written before it is renamed into place; one writer per folder. No payload may be
/// called so, and a leftover may be removed at any time.
inline constexpr std::string_view partial_name = ".partial";

std::span<const std::byte> bytes_of(std::string_view text);

/// To a temporary name in the same folder, flushed, renamed, folder flushed. Replaces an existing file.
void write_durably(const std::filesystem::path& file, std::span<const std::byte> bytes);

/// Makes `folder` and the missing folders above it, and flushes the entries that name them.
void make_folder_durably(const std::filesystem::path& folder);

/// Loops until all is written. `path` is for the message.
void write_all(int fd, std::span<const std::byte> bytes, const std::filesystem::path& path);

/// The file under a second name, its bytes shared where both are on one disk that has links, else copied. Bytes that
/// are shared must not change any more: those of sealed sessions.
void link_or_copy_durably(const std::filesystem::path& file, const std::filesystem::path& target);

void flush_folder(const std::filesystem::path& folder);

/// The whole of a regular file. Throws InputError when it is larger than `limit` bytes.
std::string read_text(const std::filesystem::path& file, std::size_t limit);

/// `name` inside `folder`; it need not be there. Throws InputError when the way to it leads through a link or when it
/// is anything but a regular file.
std::filesystem::path plain_file_inside(const std::filesystem::path& folder, const std::filesystem::path& name);

}  // namespace darkbox
