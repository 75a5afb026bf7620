#pragma once

#include <chrono>
#include <cstddef>
#include <string>

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

}  // namespace darkbox
