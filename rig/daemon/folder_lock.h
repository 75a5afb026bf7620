#pragma once

#include <filesystem>

#include "acquisition/device/unique_fd.h"

namespace darkbox {

/// Holds a folder for one daemon; the kernel lets go of it however the process ends. Makes the folder where it is
/// missing. Thread-compatible.
class FolderLock {
public:
    /// Throws InputError when another process holds it.
    explicit FolderLock(const std::filesystem::path& folder);

private:
    UniqueFd fd_;
};

}  // namespace darkbox
