#pragma once

#include <chrono>
#include <mutex>
#include <string>

#include "acquisition/frame/progress.h"

namespace darkbox {

/// A one-line progress bar on a terminal's stderr; silent elsewhere. It appears once the work has taken longer than a
/// short moment, so that quick commands stay quiet. Thread-safe.
class ProgressBar {
public:
    ProgressBar();
    ProgressBar(const ProgressBar&) = delete;
    ProgressBar& operator=(const ProgressBar&) = delete;
    ~ProgressBar();

    void show(const ProgressUpdate& update);
    /// Takes the bar off the terminal. Safe to call again.
    void finish();

private:
    using Clock = std::chrono::steady_clock;

    std::mutex mutex_;
    const bool on_terminal_;
    const Clock::time_point start_;
    Clock::time_point drawn_at_;     // guarded by mutex_
    Clock::time_point stage_start_;  // guarded by mutex_
    std::string stage_;              // guarded by mutex_
    bool visible_ = false;           // guarded by mutex_
};

/// The line the bar shows: stage, bar, counts, time left, detail. `seconds` is the time spent on this stage.
std::string progress_line(const ProgressUpdate& update, double seconds, int columns);

}  // namespace darkbox
