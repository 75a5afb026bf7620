#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "acquisition/session/session_contents.h"

namespace darkbox {

/// A session as a BagIt bag (RFC 8493).
inline constexpr std::string_view manifest_name = "manifest-sha256.txt";
inline constexpr std::string_view tag_manifest_name = "tagmanifest-sha256.txt";
inline constexpr std::string_view session_file_name = "session.json";

/// One line of a manifest; `name` is relative to the bag's folder.
struct ManifestEntry {
    std::string sha256;
    std::string name;
};

/// "HASH  NAME" lines that sha256sum -c takes; CR, LF and % in names are percent-encoded (section 2.1.3).
std::string manifest_text(const std::vector<ManifestEntry>& entries);
std::vector<ManifestEntry> parse_manifest(const std::string& where, std::string_view text);

/// True once the last file of a seal is in place: from then on the session is read-only.
bool is_sealed(const std::filesystem::path& folder);

/// Writes session.json and the tag files, the tag manifest last: its rename is the seal. May be repeated after a crash
/// at any point before.
void write_bag(const std::filesystem::path& folder, const SessionContents& contents);

/// The regular files and links below `root`, relative to it, sorted; links are not followed.
std::vector<std::string> files_below(const std::filesystem::path& root);

/// What is wrong with the bag's files, one sentence a file: missing, changed, or not listed. Empty for a good bag.
std::vector<std::string> find_bag_faults(const std::filesystem::path& folder);

std::vector<ManifestEntry> read_manifest(const std::filesystem::path& folder, std::string_view manifest);

}  // namespace darkbox
