#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>

#include "acquisition/device/unique_fd.h"

namespace darkbox {

/// A regular file, open for reading.
struct OpenFile {
    UniqueFd fd;
    std::uint64_t size = 0;
    std::string tag;  ///< changes whenever the file does; for ETag
    std::int64_t modified_s = 0;
};

/// Opens `relative` below `root` for reading. The kernel itself sees to it that the way there never leaves `root` and
/// passes no link, also while somebody changes folders. No value when there is no such regular file; throws DeviceError
/// when the system refuses for other reasons.
std::optional<OpenFile> open_beneath(const std::filesystem::path& root, const std::string& relative);

}  // namespace darkbox
