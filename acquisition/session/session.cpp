#include "acquisition/session/session.h"

#include <fmt/format.h>

#include <algorithm>
#include <unordered_map>
#include <utility>

#include "acquisition/frame/error.h"
#include "acquisition/session/bag.h"
#include "acquisition/session/durable_file.h"
#include "acquisition/session/journal.h"
#include "acquisition/session/record_checks.h"
#include "acquisition/session/session_json.h"
#include "acquisition/session/sha256.h"

namespace darkbox {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t largest_document = std::size_t{64} << 20;

/// What to do about a session that was never sealed.
std::string resume_hint(const fs::path& folder) {
    const std::string resume = fmt::format("go on where it stopped: darkbox capture --resume {}", folder.string());
    try {
        return Journal::read_head(folder).source == "import" ? "import the pictures again into a new folder" : resume;
    } catch (const Error&) {
        return resume;  // that tells what is wrong with the journal
    }
}

void require_sealed(const fs::path& folder) {
    std::error_code ignored;
    if (!fs::is_directory(folder, ignored))
        throw InputError(fmt::format("{} is not a folder", folder.string()), "name the folder of a session");
    if (is_sealed(folder)) return;
    if (fs::exists(fs::symlink_status(folder / journal_name, ignored)))
        throw InputError(fmt::format("the session {} is not sealed: it was interrupted", folder.string()),
                         resume_hint(folder));
    throw InputError(fmt::format("{} is not a session", folder.string()),
                     "make one with darkbox capture or darkbox import");
}

/// By name below data/. Also proves that every name is safe to open.
std::unordered_map<std::string, std::string> payload_checksums(const fs::path& folder) {
    const std::string where = (folder / manifest_name).string();
    std::unordered_map<std::string, std::string> checksums;
    for (const ManifestEntry& entry : read_manifest(folder, manifest_name)) {
        const bool payload = entry.name.starts_with("data/");
        const std::string name = payload ? entry.name.substr(5) : entry.name;
        if (!payload) throw InputError(fmt::format("{}: {} is outside data/", where, shown(name)), damaged_hint);
        if (name != session_file_name) require_payload_name(where, name);
        plain_file_inside(folder, entry.name);
        if (!checksums.emplace(name, entry.sha256).second)
            throw InputError(fmt::format("{}: {} is listed twice", where, shown(name)), damaged_hint);
    }
    return checksums;
}

/// The tag manifest covers files beside data/ only.
void require_tag_names(const fs::path& folder) {
    for (const ManifestEntry& entry : read_manifest(folder, tag_manifest_name))
        require_payload_name((folder / tag_manifest_name).string(), entry.name);
}

std::string read_required(const fs::path& folder, const fs::path& name) {
    const fs::path file = plain_file_inside(folder, name);
    if (!fs::exists(file)) throw InputError(fmt::format("{} is missing", file.string()), damaged_hint);
    return read_text(file, largest_document);
}

void require_bag(const fs::path& folder) {
    if (!read_required(folder, "bagit.txt").starts_with("BagIt-Version: "))
        throw InputError(fmt::format("{} is not that of a BagIt bag", (folder / "bagit.txt").string()), damaged_hint);
    read_required(folder, manifest_name);
}

void require_listed(const std::string& where, const std::vector<FrameRecord>& frames,
                    const std::unordered_map<std::string, std::string>& checksums) {
    std::unordered_map<std::string, std::size_t> seen;
    for (const FrameRecord& frame : frames) {
        const auto found = checksums.find(frame.file);
        if (found == checksums.end() || found->second != frame.sha256)
            throw InputError(
                fmt::format("{}: the manifest has another checksum for {}, or none", where, shown(frame.file)),
                damaged_hint);
        if (++seen[frame.file] > 1)
            throw InputError(fmt::format("{}: {} is listed twice", where, shown(frame.file)), damaged_hint);
    }
}

std::vector<std::string> extras_of(const std::unordered_map<std::string, std::string>& checksums,
                                   const std::vector<FrameRecord>& frames) {
    std::unordered_map<std::string, std::string> rest = checksums;
    rest.erase(std::string(session_file_name));
    for (const FrameRecord& frame : frames) rest.erase(frame.file);
    std::vector<std::string> names;
    for (const auto& [name, checksum] : rest) names.push_back(name);
    std::sort(names.begin(), names.end());
    return names;
}

}  // namespace

Session Session::open(const fs::path& folder) {
    require_sealed(folder);
    require_bag(folder);
    const fs::path file = folder / "data" / session_file_name;
    SessionDocument document =
        parse_session_document(file.string(), read_required(folder, fs::path("data") / session_file_name));
    const auto checksums = payload_checksums(folder);
    require_tag_names(folder);
    require_listed(file.string(), document.frames, checksums);

    Session session;
    session.folder_ = folder;
    session.extras_ = extras_of(checksums, document.frames);
    session.info_ = std::move(document.info);
    session.frames_ = std::move(document.frames);
    session.events_ = std::move(document.events);
    return session;
}

fs::path Session::path_of(const FrameRecord& frame) const { return folder_ / "data" / frame.file; }
fs::path Session::path_of_extra(const std::string& extra) const { return folder_ / "data" / extra; }

SessionReference Session::reference() const {
    const fs::path plain = folder_.has_filename() ? folder_ : folder_.parent_path();
    return {plain.filename().string(), sha256_of_file(folder_ / manifest_name)};
}

void Session::verify() const {
    const std::vector<std::string> faults = find_bag_faults(folder_);
    if (!faults.empty())
        throw InputError(fmt::format("{}: {}; {} bad {} in all", folder_.string(), faults.front(), faults.size(),
                                     faults.size() == 1 ? "file" : "files"),
                         damaged_hint);
    if (std::cmp_less(frames_.size(), info_.planned_shots))
        throw InputError(
            fmt::format("{}: {} frames of {} planned", folder_.string(), frames_.size(), info_.planned_shots),
            damaged_hint);
}

}  // namespace darkbox
