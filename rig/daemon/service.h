#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <filesystem>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <stop_token>
#include <string>
#include <string_view>
#include <thread>
#include <variant>

#include "acquisition/frame/error.h"
#include "rig/capture/light_by_hand.h"
#include "rig/daemon/capture_rig.h"
#include "rig/daemon/events.h"
#include "rig/daemon/folder_lock.h"
#include "rig/daemon/job.h"
#include "rig/daemon/job_book.h"
#include "rig/daemon/processing_lane.h"
#include "rig/daemon/structured_log.h"

namespace darkbox {

///            opened              capture
///   Offline ───────► Idle ─────────────────────► Busy
///                     ▲ ▲      done, cancelled,   │ │
///        lamps/dark   │ └──────failed; lamps dark─┘ │
///                   Fault ◄────lamps not proven dark┘
enum class ServiceState {
    offline,  ///< the rig's devices are not open yet; opening is tried again and again
    idle,
    busy,   ///< a capture runs, or a lamp is lit by hand; processing does not count
    fault,  ///< the lamps could not be proven dark; left by a successful lamps/dark
};
std::string_view name(ServiceState state);

/// The state does not allow what was asked; what() names the state.
class Refused : public Error {
public:
    using Error::Error;
    ~Refused() override;
};

struct ServiceOptions {
    std::filesystem::path sessions = "sessions";  ///< the folder that holds the sessions
    std::chrono::milliseconds reopen_every{2000};
    std::chrono::milliseconds look_every{10'000};  ///< at the lamps' health, while nothing is captured
    std::size_t jobs_kept = 1000;                  ///< finished jobs that can still be asked for
    /// Bytes that a capture of these orders will write, at most; empty: not known, and nothing is refused for it.
    std::function<std::uint64_t(const CaptureOrder&)> bytes_needed = {};
    std::uint64_t bytes_kept_free = 256ULL << 20;  ///< on the sessions' disk, beyond what a capture needs
    RunProcessing run_processing = {};             ///< empty: there is none, and such jobs are refused
    std::optional<RetentionRules> retention = {};  ///< none: prune jobs are refused
    /// Lights a lamp by hand and books its light; empty: refused.
    std::function<void(const HandLight&, const LentDevices&, const WorkContext&)> shine = {};
    LogSink log = [](const LogLine&) {};  ///< hears of frames and of what captures note
};

struct ServiceStatus {
    ServiceState state = ServiceState::offline;
    std::string problem = {};  ///< why Offline or Fault, in words
    std::optional<Job> running = {};
    std::size_t queued = 0;      ///< captures that wait
    std::size_t processing = 0;  ///< processing jobs, running or waiting
    std::uint64_t last_event = 0;
    LampHealth lamps = {};  ///< as last seen
};

/// What is asked cannot end well, so it does not begin: the disk is too full for it.
class NoRoom : public Error {
public:
    using Error::Error;
    ~NoRoom() override;
};

/// The daemon's state machine. One thread of its own drives the rig; it holds the single place that catches, and
/// whatever happens there, the lamps go dark. Every public function returns at once.
/// Thread-safe.
class Service {
public:
    /// Takes up the queue that an earlier daemon left. Throws InputError when another daemon has the sessions' folder.
    Service(OpenRig open, ServiceOptions options, EventLog& log);
    Service(const Service&) = delete;
    Service& operator=(const Service&) = delete;
    /// Cancels what runs, and waits until the lamps are dark and the devices closed.
    ~Service();

    ServiceStatus status() const;
    /// Throws Refused, NotFound, NoRoom, or InputError for an order that makes no sense.
    Job start_capture(const CaptureOrder& order);
    /// For later, in the order of asking: a capture begins once the rig is idle. `job` says kind, session and orders.
    /// Throws as start_capture() does.
    Job enqueue(Job job);
    Job job(std::uint64_t id) const { return book_.find(id); }
    std::vector<Job> jobs(const PageRequest& page) const { return book_.list(page); }
    std::filesystem::path job_log(std::uint64_t id) const { return book_.log_file(id); }
    /// Asks the job to stop; a finished one is left as it is.
    Job cancel(std::uint64_t id) { return book_.cancel(id); }
    /// Darkens the lamps; a running capture is cancelled for it. The event "lamps" tells how it went.
    /// Returns the number after which that event comes. Throws Refused when Offline.
    std::uint64_t darken();
    /// Lights one lamp for its time, or until the lamps are darkened. The event "light" tells how it went.
    /// Returns the number after which that event comes. Throws Refused unless Idle.
    std::uint64_t light(const HandLight& light);
    /// Since the daemon started.
    JobCounts job_counts() const { return book_.counts(); }
    std::uint64_t frames_captured() const { return frames_captured_; }
    std::uint64_t exposures_repeated() const { return exposures_repeated_; }
    const std::filesystem::path& sessions() const { return options_.sessions; }
    Catalog& catalog() { return catalog_; }

    /// Cancels what runs and lets the thread end; the event log is closed when it did.
    void request_stop() noexcept;
    /// Stops and waits for the end; says why the lamps could not be proven dark, where they could not.
    std::optional<std::string> stop();

private:
    struct Darken {};
    using Task = std::variant<Job, Darken, HandLight>;

    CaptureRequest request_for(const CaptureOrder& order, int attempt) const;

    void run(const std::stop_token& stop);
    bool open_rig(const std::stop_token& stop);
    std::optional<Task> next_task(const std::stop_token& stop);
    std::optional<Job> take_queued();
    void require_room(const CaptureOrder& order) const;
    void perform(const Job& job);
    void capture(Job& job, const WorkContext& work);
    CaptureListener listener_for(const Job& job);
    void perform(Darken);
    void perform(const HandLight& light);
    std::optional<Failure> darken_lamps();
    void look_at_lamps();
    void finish(Job job, const std::optional<Failure>& not_dark);
    void enter(ServiceState state, const std::string& problem);

    const OpenRig open_;
    const ServiceOptions options_;
    EventLog& log_;
    const FolderLock lock_;
    Catalog catalog_;
    JobBook book_;

    mutable std::mutex mutex_;
    std::condition_variable_any wake_;
    ServiceState state_ = ServiceState::offline;  // guarded by mutex_
    std::string problem_;                         // guarded by mutex_
    std::deque<Task> tasks_;                      // guarded by mutex_
    std::uint64_t running_ = 0;                   // guarded by mutex_; 0 = none
    std::optional<std::stop_source> hand_light_;  // guarded by mutex_; a lamp is lit by hand, or about to be
    bool stopping_ = false;                       // guarded by mutex_
    LampHealth lamps_;                            // guarded by mutex_

    std::atomic<std::uint64_t> frames_captured_{0};
    std::atomic<std::uint64_t> exposures_repeated_{0};

    std::unique_ptr<CaptureRig> rig_;  // the thread's own
    std::optional<Failure> not_dark_;  // the thread's own until it was joined
    ProcessingLane processing_;
    std::jthread thread_;  // last: ends before what it uses
};

}  // namespace darkbox
