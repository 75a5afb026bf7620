#pragma once

#include <chrono>
#include <cstddef>
#include <iterator>
#include <string>
#include <vector>

#include "acquisition/frame/progress.h"

namespace darkbox {

/// Tells the progress and honours a wish to stop: throws Cancelled then. Files written so far are whole.
void step(const WorkContext& work, const ProgressUpdate& update);

/// Seconds since it was made, or since the last lap.
class Stopwatch {
public:
    double lap();

private:
    std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

inline void append(std::vector<std::string>& to, std::vector<std::string> more) {
    to.insert(to.end(), std::make_move_iterator(more.begin()), std::make_move_iterator(more.end()));
}

}  // namespace darkbox
