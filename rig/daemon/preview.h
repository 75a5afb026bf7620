#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>

namespace darkbox {

/// The frame of an unsealed or sealed session that was acknowledged last.
struct LatestFrame {
    std::string file;   ///< relative to the session's data/
    std::string lamp;   ///< empty: dark
    std::string bytes;  ///< a JPEG of at most `preview_side` pixels a side, brightened for looking at
};

inline constexpr int preview_side = 640;  ///< pixels

/// No value while nothing was acknowledged. Throws InputError when the frame does not read.
std::optional<LatestFrame> latest_frame(const std::filesystem::path& session);

}  // namespace darkbox
