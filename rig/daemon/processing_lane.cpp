#include "rig/daemon/processing_lane.h"

#include <fmt/format.h>

#include "acquisition/frame/error.h"
#include "rig/daemon/attempt.h"

namespace darkbox {

ProcessingLane::ProcessingLane(JobBook& book, Catalog& catalog, RunProcessing run)
    : book_(book), catalog_(catalog), run_(std::move(run)) {
    if (run_) thread_ = std::jthread([this](const std::stop_token& stop) { this->run(stop); });
}

ProcessingLane::~ProcessingLane() { request_stop(); }

void ProcessingLane::request_stop() noexcept {
    thread_.request_stop();
    book_.cancel_running(Lane::processing);
}

void ProcessingLane::run(const std::stop_token& stop) {
    while (book_.wait_for_queued(Lane::processing, stop) && !stop.stop_requested()) {
        std::optional<Job> job;
        // A disk that refuses now may take it in a moment.
        if (attempt([&] { job = book_.take(Lane::processing); })) std::this_thread::sleep_for(std::chrono::seconds(1));
        if (job) perform(std::move(*job), stop);
    }
}

void ProcessingLane::perform(Job job, const std::stop_token& stop) {
    WorkContext work;
    work.stop = book_.stop_token(job.id);
    work.report = [&](const ProgressUpdate& update) { book_.progress(job.id, update); };
    const auto failure = attempt([&] {
        // What other jobs wait for is known only now.
        if (job.kind == JobKind::prune) job.orders["keep"] = book_.sessions_in_use();
        job.result = run_(job, catalog_.folder() / job.session, work,
                          [&](const std::string& line) { book_.note(job.id, line); });
    });
    if (failure && failure->cancelled && stop.stop_requested()) {
        bool goes_on = true;
        (void)attempt([&] { goes_on = book_.put_back(job.id); });  // else a restart finds it cut off, and queues it
        if (goes_on) return;
    }
    (void)attempt([&] { job.session.empty() ? catalog_.refresh() : catalog_.refresh(job.session); });
    job.state = !failure ? JobState::done : failure->cancelled ? JobState::cancelled : JobState::failed;
    if (failure) job.failure = *failure;
    book_.finish(std::move(job));
}

}  // namespace darkbox
