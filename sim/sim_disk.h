#pragma once

#include <atomic>
#include <cerrno>
#include <cstdint>

#include "sim/faults.h"

namespace darkbox::sim {

/// The disk under the twin's session: whole, but for the writes that the faults name. Thread-safe.
class SimDisk {
public:
    explicit SimDisk(FaultPlan faults) : faults_(std::move(faults)) {}

    /// Whether it may fail at all.
    bool has_faults() const {
        for (const Fault& fault : faults_.faults)
            if (fault.kind == FaultKind::failed_write || fault.kind == FaultKind::full_disk) return true;
        return false;
    }
    /// What the next write ends in: an errno, or 0.
    int next_write() {
        const std::uint64_t write = writes_++;
        if (faults_.hits(FaultKind::full_disk, write)) return ENOSPC;
        return faults_.hits(FaultKind::failed_write, write) ? EIO : 0;
    }
    std::uint64_t writes() const { return writes_; }

private:
    FaultPlan faults_;
    std::atomic<std::uint64_t> writes_{0};
};

}  // namespace darkbox::sim
