#include <fmt/format.h>

#include "acquisition/session/bag.h"
#include "acquisition/session/journal.h"
#include "acquisition/session/session.h"
#include "rig/daemon/job_book.h"

namespace darkbox {
namespace {

namespace fs = std::filesystem;

constexpr int most_attempts = 3;

Job failed(Job job) {
    job.state = JobState::failed;
    job.ended = iso8601_now();
    job.failure = {.what = fmt::format("darkboxd ended {} times while this ran", job.attempts),
                   .hint = job.session.empty()
                               ? "look into its log for why"
                               : fmt::format("look into its log for why; session {} is as it was left", job.session)};
    return job;
}

Job finished(Job job, const fs::path& folder) {
    job.state = JobState::done;
    job.ended = iso8601_now();
    job.outcome.session = folder;
    try {
        job.outcome.frames = Session::open(folder).frames().size();
    } catch (const Error& error) {
        job.state = JobState::failed;
        job.failure = {.what = error.what(), .hint = error.hint()};
    }
    return job;
}

/// The orders that go on where the capture was. What it was begun with its session knows by itself; how to take its
/// lamps and what is to follow it does not.
Job resumed(Job job, const fs::path& sessions) {
    if (job.session.empty()) return job;
    std::error_code ignored;
    if (!fs::exists(sessions / job.session / journal_name, ignored)) {
        job.orders.erase("resume");
        job.orders["name"] = job.session;
        return job;
    }
    nlohmann::json orders = {{"resume", job.session}};
    for (const char* key : {"mode", "process"})
        if (job.orders.contains(key)) orders[key] = job.orders[key];
    job.orders = std::move(orders);
    return job;
}

}  // namespace

std::optional<Job> follow_up(const Job& job) {
    if (job.state != JobState::done || lane_of(job.kind) != Lane::rig) return std::nullopt;
    Job next;
    next.session = job.session;
    if (job.kind == JobKind::recalibrate) {
        next.kind = JobKind::calibrate;
    } else if (job.orders.value("process", false)) {
        next.kind = JobKind::process;
    } else {
        return std::nullopt;
    }
    return next;
}

Job after_a_crash(Job job, const fs::path& sessions) {
    const bool captures = lane_of(job.kind) == Lane::rig;
    const fs::path session = sessions / job.session;
    if (captures && !job.session.empty() && is_sealed(session)) return finished(std::move(job), session);
    if (job.attempts >= most_attempts) return failed(std::move(job));
    job.state = JobState::queued;
    if (!captures) return job;
    return resumed(std::move(job), sessions);
}

}  // namespace darkbox
