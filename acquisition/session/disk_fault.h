#pragma once

#include <filesystem>
#include <functional>

namespace darkbox {

/// Called before each write to a file; says which errno it is to fail with, or 0. May be called by several threads.
using DiskFault = std::function<int()>;

/// While it lives, the disk under `folder` fails when `fault` says so: a write that finds the disk full (ENOSPC) leaves
/// half of its bytes behind, any other none. For simulated rigs. One at a time in a process; thread-safe.
class FailingDisk {
public:
    FailingDisk(std::filesystem::path folder, DiskFault fault);
    FailingDisk(const FailingDisk&) = delete;
    FailingDisk& operator=(const FailingDisk&) = delete;
    ~FailingDisk();
};

/// What the next write to this file is to fail with; 0 where no disk fails.
int disk_fault_of(const std::filesystem::path& file);

}  // namespace darkbox
