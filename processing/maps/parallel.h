#pragma once

#include <tbb/global_control.h>
#include <tbb/info.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <cstddef>
#include <utility>

#include "acquisition/frame/progress.h"

namespace darkbox {

/// Runs `body` where TBB's algorithms use as many threads as `work` allows. Results must not depend on that number:
/// reduce in blocks whose borders follow from the data's size alone, and add the blocks up in their order.
template <class Body>
decltype(auto) on_threads_of(const WorkContext& work, Body&& body) {
    const int cores = tbb::info::default_concurrency();
    const int threads = work.threads > 0 ? work.threads : cores;
    // More threads than cores, as tests ask for, exist only where TBB is told so.
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism,
                                    static_cast<std::size_t>(std::max(threads, cores)));
    tbb::task_arena arena(threads);
    return arena.execute(std::forward<Body>(body));
}

}  // namespace darkbox
