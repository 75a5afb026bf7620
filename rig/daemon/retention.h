#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "acquisition/frame/progress.h"
#include "rig/description/retention_rules.h"

namespace darkbox {

struct PruneOptions {
    RetentionRules rules;
    bool dry_run = false;             ///< everything but the removing
    std::set<std::string> keep = {};  ///< sessions that stay whatever the rules say, such as those that a job waits for
    std::chrono::system_clock::time_point now = std::chrono::system_clock::now();
    /// Free bytes on the disk of a folder; for tests.
    std::uint64_t (*free_bytes)(const std::filesystem::path& folder) = nullptr;
};

struct RemovedSession {
    std::string name;
    std::string created;      ///< ISO 8601, UTC
    std::uint64_t bytes = 0;  ///< of its files
};

struct PruneReport {
    std::vector<RemovedSession> removed;      ///< or would be, of a dry run; oldest first
    std::map<std::string, std::size_t> kept;  ///< how many, by the reason in words
    std::vector<std::string> unverified;      ///< due, but they stay: "vase-1: data/... does not match its checksum"
    std::uint64_t bytes = 0;                  ///< of what was removed
};

/// Removes what the rules allow, oldest first. A session stays, however old, unless it is a sealed capture of this rig
/// whose frames were all verified when they were taken and whose every checksum holds now; and while another session
/// refers to it (a member "session" in what the other says of itself, as re-takes have), or it is the first or the last
/// calibration of its rig, which others are compared with. A session goes at once from where sessions are listed, and
/// then from the disk. Throws InputError for rules that make no sense, DeviceError when the disk refuses, Cancelled.
PruneReport prune_sessions(const std::filesystem::path& folder, const PruneOptions& options,
                           const WorkContext& work = {});

}  // namespace darkbox
