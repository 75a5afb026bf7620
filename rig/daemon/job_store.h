#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "rig/daemon/catalog.h"
#include "rig/daemon/job.h"

namespace darkbox {

/// The jobs' table of a catalogue: what was written survives SIGKILL and power loss. Thread-safe; throws DeviceError
/// when the disk refuses.
class JobStore {
public:
    explicit JobStore(Catalog& catalog) : catalog_(catalog) {}

    /// The id of the new row.
    std::uint64_t add(const Job& job);
    void save(const Job& job);
    /// Both or neither: the job that ended, and the one that follows from it, whose id comes back.
    std::uint64_t save_with_next(Job& job, const Job& next);

    std::optional<Job> find(std::uint64_t id) const;
    /// Newest first, those before `page.after`.
    std::vector<Job> list(const PageRequest& page) const;
    /// Queued or running, oldest first.
    std::vector<Job> unfinished() const;
    /// Removes all but this many of those that ended; returns the removed ones' ids.
    std::vector<std::uint64_t> prune(std::size_t kept);

private:
    Catalog& catalog_;
};

}  // namespace darkbox
