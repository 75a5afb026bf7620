#pragma once

#include <filesystem>
#include <string_view>

#include "acquisition/device/unique_fd.h"

namespace darkbox {

inline constexpr std::string_view lock_name = "writer.lock";

/// Holds SESSION/writer.lock until the descriptor is closed; the kernel frees it when the process dies.
/// Throws InputError when another writer holds it.
UniqueFd lock_session(const std::filesystem::path& folder);

}  // namespace darkbox
