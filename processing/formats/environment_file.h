#pragma once

#include <filesystem>

#include "processing/relight/relight.h"

namespace darkbox {

/// Equirectangular .hdr (Radiance RGBE) or .exr: row 0 is straight up, the middle column looks along -z. Throws
/// InputError: missing, damaged, not finite, negative, or not twice as wide as high.
Environment read_environment(const std::filesystem::path& path);

}  // namespace darkbox
