#include "rig/daemon/job_book.h"

#include <fmt/format.h>

#include <algorithm>
#include <fstream>

#include "acquisition/session/durable_file.h"
#include "acquisition/session/session.h"

namespace darkbox {
namespace {

namespace fs = std::filesystem;

constexpr std::uintmax_t longest_log = 1024 * 1024;  ///< bytes

}  // namespace

NotFound::~NotFound() = default;

JobBook::JobBook(Catalog& catalog, EventLog& log, std::size_t kept)
    : catalog_(catalog), store_(catalog), log_(log), kept_(kept) {
    make_folder_durably(catalog.own_folder() / "jobs");
    for (Job& job : store_.unfinished()) {
        if (job.state == JobState::running) {
            job = after_a_crash(std::move(job), catalog.folder());
            keep(job);
            note(job.id, fmt::format("darkboxd ended while this ran; now {}", name(job.state)));
        }
        if (!job.ended_already()) live_.emplace(job.id, Live{job});
    }
}

Job JobBook::add(Job job) {
    const std::scoped_lock lock(mutex_);
    job.created = iso8601_now();
    job.event = log_.last();
    if (job.state == JobState::running) {
        job.started = job.created;
        job.attempts = 1;
    }
    job.id = store_.add(job);
    live_.emplace(job.id, Live{job});
    wake_.notify_all();
    return job;
}

std::optional<Job> JobBook::take(Lane lane) {
    const std::scoped_lock lock(mutex_);
    for (auto& [id, live] : live_) {
        Job& job = live.job;
        if (job.state != JobState::queued || lane_of(job.kind) != lane) continue;
        Job begun = job;
        begun.state = JobState::running;
        begun.started = iso8601_now();
        ++begun.attempts;
        store_.save(begun);
        job = std::move(begun);
        return job;
    }
    return std::nullopt;
}

bool JobBook::has_queued(Lane lane) const {
    const std::scoped_lock lock(mutex_);
    return std::ranges::any_of(live_, [lane](const auto& entry) {
        return entry.second.job.state == JobState::queued && lane_of(entry.second.job.kind) == lane;
    });
}

bool JobBook::wait_for_queued(Lane lane, const std::stop_token& stop) const {
    std::unique_lock lock(mutex_);
    return wake_.wait(lock, stop, [&] {
        return std::ranges::any_of(live_, [lane](const auto& entry) {
            return entry.second.job.state == JobState::queued && lane_of(entry.second.job.kind) == lane;
        });
    });
}

bool JobBook::put_back(std::uint64_t id) {
    const std::scoped_lock lock(mutex_);
    Live& entry = live(id);
    if (entry.cancelled) return false;
    entry.job.state = JobState::queued;
    entry.job.attempts = std::max(0, entry.job.attempts - 1);
    entry.stop = std::stop_source();
    store_.save(entry.job);
    return true;
}

JobBook::Live& JobBook::live(std::uint64_t id) {
    const auto found = live_.find(id);
    if (found == live_.end())
        throw NotFound(fmt::format("there is no job {}", id), "GET jobs lists those that are kept");
    return found->second;
}

Job JobBook::find(std::uint64_t id) const {
    const std::scoped_lock lock(mutex_);
    if (const auto found = live_.find(id); found != live_.end()) return found->second.job;
    if (const auto found = unsaved_.find(id); found != unsaved_.end()) return found->second;
    if (auto kept = store_.find(id)) return std::move(*kept);
    throw NotFound(fmt::format("there is no job {}", id), "GET jobs lists those that are kept");
}

std::vector<Job> JobBook::list(const PageRequest& page) const {
    const std::scoped_lock lock(mutex_);
    std::vector<Job> jobs = store_.list(page);
    for (Job& job : jobs) {  // what is in memory is newer
        if (const auto found = live_.find(job.id); found != live_.end()) job = found->second.job;
        if (const auto found = unsaved_.find(job.id); found != unsaved_.end()) job = found->second;
    }
    return jobs;
}

std::size_t JobBook::unfinished(Lane lane) const {
    const std::scoped_lock lock(mutex_);
    return static_cast<std::size_t>(
        std::ranges::count_if(live_, [lane](const auto& entry) { return lane_of(entry.second.job.kind) == lane; }));
}

std::vector<std::string> JobBook::sessions_in_use() const {
    const std::scoped_lock lock(mutex_);
    std::vector<std::string> names;
    for (const auto& entry : live_) {
        const Job& job = entry.second.job;
        if (!job.session.empty()) names.push_back(job.session);
        for (const char* key : {"resume", "retake", "flats_from"})
            if (auto name = job.orders.value(key, std::string()); !name.empty()) names.push_back(std::move(name));
    }
    return names;
}

JobCounts JobBook::counts() const {
    const std::scoped_lock lock(mutex_);
    return counts_;
}

Job JobBook::cancel(std::uint64_t id) {
    Job job = find(id);
    if (job.ended_already()) return job;
    {
        const std::scoped_lock lock(mutex_);
        const auto found = live_.find(id);
        if (found == live_.end()) return job;  // it ended just now
        found->second.cancelled = true;
        found->second.stop.request_stop();
        job = found->second.job;
        if (job.state != JobState::queued) return job;
        found->second.job.state = job.state = JobState::cancelled;  // no lane takes it any more
    }
    job.failure = {.cancelled = true, .what = "it was cancelled before it began", .hint = "ask for it again"};
    return finish(std::move(job));
}

std::stop_token JobBook::stop_token(std::uint64_t id) const {
    const std::scoped_lock lock(mutex_);
    if (const auto found = live_.find(id); found != live_.end()) return found->second.stop.get_token();
    std::stop_source ended;
    ended.request_stop();
    return ended.get_token();
}

void JobBook::cancel_running(Lane lane) {
    const std::scoped_lock lock(mutex_);
    for (auto& entry : live_)
        if (entry.second.job.state == JobState::running && lane_of(entry.second.job.kind) == lane)
            entry.second.stop.request_stop();
}

void JobBook::set_session(std::uint64_t id, const std::string& session) {
    const std::scoped_lock lock(mutex_);
    Job& job = live(id).job;
    job.session = session;
    store_.save(job);
}

void JobBook::progress(std::uint64_t id, const ProgressUpdate& update) {
    {
        const std::scoped_lock lock(mutex_);
        live(id).job.progress = update;
    }
    log_.publish("progress", {{"job", id},
                              {"stage", update.stage},
                              {"done", update.done},
                              {"total", update.total},
                              {"detail", update.detail}});
}

/// With mutex_ held: the job, and what follows from it, on disk and in memory.
void JobBook::keep(Job& job) {
    auto next = follow_up(job);
    if (!next) return store_.save(job);
    next->created = iso8601_now();
    next->event = log_.last();
    next->id = store_.save_with_next(job, *next);
    live_.emplace(next->id, Live{*next});
    wake_.notify_all();
}

Job JobBook::finish(Job job) {
    job.ended = iso8601_now();
    note(job.id, fmt::format("{}{}{}", name(job.state), job.failure.what.empty() ? "" : ": ", job.failure.what));
    const std::scoped_lock lock(mutex_);
    if (const auto found = live_.find(job.id); found != live_.end()) job.progress = found->second.job.progress;
    live_.erase(job.id);
    ++counts_[{job.kind, job.state}];
    try {
        keep(job);
        prune();
        for (const auto& entry : unsaved_) store_.save(entry.second);
        unsaved_.clear();
    } catch (const Error& error) {
        // Unless the disk takes it later, it counts as cut off after a restart: a capture is found sealed, processing
        // is done again.
        unsaved_[job.id] = job;
        log_.publish("problem", {{"job", job.id}, {"detail", error.what()}, {"hint", error.hint()}});
    }
    nlohmann::json fields = to_json(job);
    fields["job"] = job.id;
    log_.publish(std::string(name(job.state)), std::move(fields));
    return job;
}

void JobBook::prune() {
    for (const std::uint64_t id : store_.prune(kept_)) {
        std::error_code ignored;
        fs::remove(log_file(id), ignored);
    }
}

fs::path JobBook::log_file(std::uint64_t id) const {
    return catalog_.own_folder() / "jobs" / fmt::format("{}.log", id);
}

void JobBook::note(std::uint64_t id, const std::string& line) noexcept {
    try {
        const fs::path file = log_file(id);
        std::error_code none;
        const auto size = fs::file_size(file, none);
        if (!none && size > longest_log) return;
        std::ofstream(file, std::ios::app) << iso8601_now() << ' ' << line << '\n';
    } catch (const std::exception&) {  // NOLINT(bugprone-empty-catch): see the declaration
    }
}

}  // namespace darkbox
