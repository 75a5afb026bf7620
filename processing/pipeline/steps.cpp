#include "processing/pipeline/steps.h"

#include "acquisition/frame/error.h"

namespace darkbox {

void step(const WorkContext& work, const ProgressUpdate& update) {
    if (work.cancelled()) throw Cancelled("stopped while at work on: " + update.stage, "run the same command again");
    work.tell(update);
}

double Stopwatch::lap() {
    const auto now = std::chrono::steady_clock::now();
    const std::chrono::duration<double> passed = now - start_;
    start_ = now;
    return passed.count();
}

}  // namespace darkbox
