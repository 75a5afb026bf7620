#include "acquisition/session/bag.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <unordered_set>
#include <utility>

#include "acquisition/device/device_error.h"
#include "acquisition/session/durable_file.h"
#include "acquisition/session/record_checks.h"
#include "acquisition/session/session_json.h"
#include "acquisition/session/sha256.h"

namespace darkbox {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t largest_manifest = std::size_t{64} << 20;
constexpr std::string_view bagit_text = "BagIt-Version: 1.0\nTag-File-Character-Encoding: UTF-8\n";

constexpr std::array<std::pair<char, std::string_view>, 3> encoded_characters{{
    {'\n', "%0A"},
    {'\r', "%0D"},
    {'%', "%25"},
}};

std::string percent_encode(std::string_view name) {
    std::string text;
    for (const char c : name) {
        const auto* found = std::find_if(encoded_characters.begin(), encoded_characters.end(),
                                         [c](const auto& pair) { return pair.first == c; });
        if (found == encoded_characters.end())
            text += c;
        else
            text += found->second;
    }
    return text;
}

std::string percent_decode(std::string_view text) {
    std::string name;
    while (!text.empty()) {
        const auto* found = std::find_if(encoded_characters.begin(), encoded_characters.end(),
                                         [text](const auto& pair) { return text.starts_with(pair.second); });
        const bool encoded = found != encoded_characters.end();
        name += encoded ? found->first : text.front();
        text.remove_prefix(encoded ? found->second.size() : 1);
    }
    return name;
}

/// A value of bag-info.txt stays on its line.
std::string one_line(std::string text) {
    std::replace_if(text.begin(), text.end(), [](char c) { return c == '\n' || c == '\r'; }, ' ');
    return text;
}

/// "Label: value". A line break goes on in a line that begins with white space (RFC 8493, section 2.2.2: the break
/// belongs to the value, the padding does not, so a line's own leading blanks cannot be kept). Long lines are left
/// whole, as any other break would change the value.
std::string tag(std::string_view label, std::string_view value) {
    std::string text = fmt::format("{}:", label);
    for (std::string_view rest = value;;) {
        const std::size_t end = std::min(rest.find('\n'), rest.size());
        std::string_view line = rest.substr(0, end);
        line.remove_prefix(std::min(line.find_first_not_of(" \t"), line.size()));
        text += fmt::format(" {}\n", line);
        if (end == rest.size()) return text;
        rest.remove_prefix(end + 1);
    }
}

/// "DC-Title: A vase", a line for each value; elements beyond the reserved ones are allowed (section 2.2.2).
std::string object_tags(const SessionInfo& info) {
    std::string text;
    if (!info.object.empty()) text += tag("Object", one_line(info.object));
    if (!info.record.inventory.empty()) text += tag("Inventory-Number", info.record.inventory);
    for (const auto& [element, values] : info.record.dublin_core) {
        std::string label = "DC-" + element;
        label[3] = static_cast<char>(std::toupper(static_cast<unsigned char>(label[3])));
        for (const std::string& value : values) text += tag(label, value);
    }
    return text;
}

std::string bag_info_text(const SessionContents& contents, const Payload& document) {
    std::uint64_t bytes = document.size;
    for (const Payload& payload : contents.payloads) bytes += payload.size;
    const std::string identifier =
        contents.info.record.inventory.empty() ? one_line(contents.info.object) : contents.info.record.inventory;
    return fmt::format(
        "Bag-Software-Agent: darkbox\n"
        "Bagging-Date: {}\n"
        "External-Identifier: {}\n"
        "External-Description: photometric session of {}: {} frames, {} of {}\n"
        "Payload-Oxum: {}.{}\n"
        "{}",
        iso8601_now().substr(0, 10), identifier, one_line(contents.info.object), contents.frames.size(),
        one_line(contents.info.source), one_line(contents.info.created), bytes, contents.payloads.size() + 1,
        object_tags(contents.info));
}

std::string payload_manifest(const SessionContents& contents, const Payload& document) {
    std::vector<ManifestEntry> entries{{document.sha256, fmt::format("data/{}", document.name)}};
    for (const Payload& payload : contents.payloads) entries.push_back({payload.sha256, "data/" + payload.name});
    std::sort(entries.begin(), entries.end(), [](const auto& a, const auto& b) { return a.name < b.name; });
    return manifest_text(entries);
}

Payload write_document(const fs::path& folder, const SessionContents& contents) {
    const std::string text = session_document(contents);
    write_durably(folder / "data" / session_file_name, bytes_of(text));
    return {std::string(session_file_name), text.size(), sha256_hex(bytes_of(text))};
}

std::string fault_of(const fs::path& folder, const ManifestEntry& entry) {
    const fs::path file = plain_file_inside(folder, entry.name);
    if (!fs::exists(file)) return fmt::format("{} is missing", entry.name);
    if (sha256_of_file(file) != entry.sha256) return fmt::format("{} does not match its checksum", entry.name);
    return {};
}

/// A file that cannot be read, or a link, is one fault among others, not the end of the search.
void note_fault(std::vector<std::string>& faults, const fs::path& folder, const ManifestEntry& entry) {
    try {
        std::string fault = fault_of(folder, entry);
        if (!fault.empty()) faults.push_back(std::move(fault));
    } catch (const Error& error) {
        faults.emplace_back(error.what());
    }
}

}  // namespace

std::string manifest_text(const std::vector<ManifestEntry>& entries) {
    std::string text;
    for (const ManifestEntry& entry : entries)
        text += fmt::format("{}  {}\n", entry.sha256, percent_encode(entry.name));
    return text;
}

std::vector<ManifestEntry> parse_manifest(const std::string& where, std::string_view text) {
    constexpr std::size_t hash_digits = 64;
    std::vector<ManifestEntry> entries;
    while (!text.empty()) {
        const std::string place = fmt::format("{} line {}", where, entries.size() + 1);
        const std::size_t end = std::min(text.find('\n'), text.size());
        std::string_view line = text.substr(0, end);
        text.remove_prefix(std::min(end + 1, text.size()));
        if (line.ends_with('\r')) line.remove_suffix(1);
        require_sha256(place, line.substr(0, hash_digits));
        std::string_view name = line.substr(hash_digits);
        if (!name.starts_with("  ") && !name.starts_with(" *"))
            throw InputError(fmt::format("{}: {} is not a checksum and a file", place, shown(line)),
                             "the session is damaged or was not written by darkbox; take it from a backup");
        name.remove_prefix(2);
        entries.push_back({std::string(line.substr(0, hash_digits)), percent_decode(name)});
    }
    return entries;
}

std::vector<ManifestEntry> read_manifest(const fs::path& folder, std::string_view manifest) {
    const fs::path file = plain_file_inside(folder, manifest);
    return parse_manifest(file.string(), read_text(file, largest_manifest));
}

bool is_sealed(const fs::path& folder) {
    std::error_code ignored;
    return fs::exists(fs::symlink_status(folder / tag_manifest_name, ignored));
}

void write_bag(const fs::path& folder, const SessionContents& contents) {
    const Payload document = write_document(folder, contents);
    const std::array<std::pair<std::string, std::string>, 3> tags{{
        {"bag-info.txt", bag_info_text(contents, document)},
        {"bagit.txt", std::string(bagit_text)},
        {std::string(manifest_name), payload_manifest(contents, document)},
    }};
    std::vector<ManifestEntry> tag_entries;
    for (const auto& [name, text] : tags) {
        write_durably(folder / name, bytes_of(text));
        tag_entries.push_back({sha256_hex(bytes_of(text)), name});
    }
    write_durably(folder / tag_manifest_name, bytes_of(manifest_text(tag_entries)));
}

std::vector<std::string> files_below(const fs::path& root) {
    std::vector<std::string> files;
    try {
        for (const auto& entry : fs::recursive_directory_iterator(root))
            if (entry.is_symlink() || !entry.is_directory())
                files.push_back(entry.path().lexically_relative(root).generic_string());
    } catch (const fs::filesystem_error& error) {
        throw_errno("read folder", root.string(), error.code().value());
    }
    std::sort(files.begin(), files.end());
    return files;
}

std::vector<std::string> find_bag_faults(const fs::path& folder) {
    std::vector<std::string> faults;
    std::unordered_set<std::string> listed;
    for (const ManifestEntry& entry : read_manifest(folder, manifest_name)) {
        note_fault(faults, folder, entry);
        listed.insert(entry.name);
    }
    for (const ManifestEntry& entry : read_manifest(folder, tag_manifest_name)) note_fault(faults, folder, entry);
    for (const std::string& file : files_below(folder / "data"))
        if (!listed.contains("data/" + file)) faults.push_back("data/" + file + " is not in the manifest");
    return faults;
}

}  // namespace darkbox
