#pragma once

#include <condition_variable>
#include <cstdint>
#include <filesystem>
#include <map>
#include <mutex>
#include <optional>
#include <stop_token>
#include <string>
#include <utility>
#include <vector>

#include "acquisition/frame/error.h"
#include "rig/daemon/events.h"
#include "rig/daemon/job.h"
#include "rig/daemon/job_store.h"

namespace darkbox {

/// There is no such job or session.
class NotFound : public Error {
public:
    using Error::Error;
    ~NotFound() override;
};

using JobCounts = std::map<std::pair<JobKind, JobState>, std::uint64_t>;

/// Every job the daemon was asked for, from its acceptance on: the queues of both lanes, progress, history, and a log
/// each. What is accepted or ended is on disk before it is told; a job that ran when the daemon was killed is queued
/// again. Thread-safe.
class JobBook {
public:
    /// `kept`: jobs that ended and can still be asked for.
    JobBook(Catalog& catalog, EventLog& log, std::size_t kept);

    /// Gives id and times. A job that is `running` already is not queued. Throws DeviceError when it cannot be kept:
    /// then it was not accepted.
    Job add(Job job);
    /// The oldest queued job of a lane, now running. No value when there is none.
    std::optional<Job> take(Lane lane);
    bool has_queued(Lane lane) const;
    /// Waits until take() would give one, or the token stops. Whether there is one.
    bool wait_for_queued(Lane lane, const std::stop_token& stop) const;
    /// Puts a running job back to its place in the queue; it does not count as begun. False, and nothing is done, where
    /// somebody cancelled it.
    bool put_back(std::uint64_t id);

    Job find(std::uint64_t id) const;
    std::vector<Job> list(const PageRequest& page) const;
    std::size_t unfinished(Lane lane) const;
    /// Of queued and running jobs.
    std::vector<std::string> sessions_in_use() const;
    /// Of those that ended since the book was opened.
    JobCounts counts() const;

    /// A queued job is cancelled at once, a running one asked to stop; one that ended is left as it is.
    Job cancel(std::uint64_t id);
    /// What ended has been asked to stop.
    std::stop_token stop_token(std::uint64_t id) const;
    void cancel_running(Lane lane);

    /// Kept before the work begins, so that a crash knows what to go on with.
    void set_session(std::uint64_t id, const std::string& session);
    void progress(std::uint64_t id, const ProgressUpdate& update);
    /// Queues what follows from it as well. The end is told even where the disk refuses to keep it. Returns the job as
    /// it is kept.
    Job finish(Job job);

    /// A line for the job's log. Never throws: a log is not worth a capture.
    void note(std::uint64_t id, const std::string& line) noexcept;
    std::filesystem::path log_file(std::uint64_t id) const;

private:
    struct Live {
        Job job;
        std::stop_source stop = {};
        bool cancelled = false;  ///< by somebody's wish
    };
    Live& live(std::uint64_t id);
    void keep(Job& job);
    void prune();

    Catalog& catalog_;
    JobStore store_;
    EventLog& log_;
    const std::size_t kept_;
    mutable std::mutex mutex_;
    mutable std::condition_variable_any wake_;
    std::map<std::uint64_t, Live> live_;    // guarded by mutex_; queued or running
    JobCounts counts_;                      // guarded by mutex_
    std::map<std::uint64_t, Job> unsaved_;  // guarded by mutex_; ended, but the disk refused
};

/// The job that is to be queued once this one is done.
std::optional<Job> follow_up(const Job& job);

/// What becomes of a job that was running when the daemon ended without a word: queued again, a capture so that it goes
/// on with its session; done, when the session is sealed; failed, when that has happened too often.
Job after_a_crash(Job job, const std::filesystem::path& sessions);

}  // namespace darkbox
