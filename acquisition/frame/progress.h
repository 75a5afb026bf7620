#pragma once

#include <cstddef>
#include <functional>
#include <stop_token>
#include <string>

namespace darkbox {

/// One step of long work, told to whoever shows it. `done` of `total` steps; total 0 = unknown.
struct ProgressUpdate {
    std::string stage;
    std::size_t done = 0;
    std::size_t total = 0;
    std::string detail;
};

/// How long work reports and is stopped. Both parts may be left empty.
/// Thread-compatible: `report` is called from the one thread that does the work.
struct WorkContext {
    std::function<void(const ProgressUpdate&)> report;
    std::stop_token stop;
    int threads = 0;  ///< 0 = all cores

    void tell(const ProgressUpdate& update) const {
        if (report) report(update);
    }
    bool cancelled() const { return stop.stop_requested(); }
};

}  // namespace darkbox
