#pragma once

#include <cstddef>
#include <filesystem>
#include <mutex>
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

/// Makes each picture once, however many ask for it while it is the last. Thread-safe.
class Preview {
public:
    /// No value while nothing was acknowledged. Throws InputError when the frame does not read.
    std::optional<LatestFrame> latest(const std::filesystem::path& session);

private:
    std::mutex mutex_;
    std::filesystem::path session_;  // guarded by mutex_
    std::string sha256_;             // guarded by mutex_; of the frame that was made last
    LatestFrame made_;               // guarded by mutex_
};

}  // namespace darkbox
