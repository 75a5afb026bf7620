#pragma once

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <stop_token>
#include <string>
#include <string_view>
#include <thread>
#include <variant>

#include "acquisition/frame/error.h"
#include "rig/daemon/capture_rig.h"
#include "rig/daemon/events.h"
#include "rig/daemon/job.h"

namespace darkbox {

///            opened              capture
///   Offline ───────► Idle ─────────────────────► Busy
///                     ▲ ▲      done, cancelled,   │ │
///        lamps/dark   │ └──────failed; lamps dark─┘ │
///                   Fault ◄────lamps not proven dark┘
enum class ServiceState {
    offline,  ///< the rig's devices are not open yet; opening is tried again and again
    idle,
    busy,   ///< a capture runs
    fault,  ///< the lamps could not be proven dark; left by a successful lamps/dark
};
std::string_view name(ServiceState state);

/// The state does not allow what was asked; what() names the state.
class Refused : public Error {
public:
    using Error::Error;
    ~Refused() override;
};

/// There is no such job or session.
class NotFound : public Error {
public:
    using Error::Error;
    ~NotFound() override;
};

struct ServiceOptions {
    std::filesystem::path sessions = "sessions";  ///< the folder that holds the sessions
    std::chrono::milliseconds reopen_every{2000};
    std::size_t jobs_kept = 64;  ///< finished jobs that can still be asked for
};

struct ServiceStatus {
    ServiceState state = ServiceState::offline;
    std::string problem = {};  ///< why Offline or Fault, in words
    std::optional<Job> running = {};
    std::uint64_t last_event = 0;
};

/// The daemon's state machine. One thread of its own drives the rig; it holds the single place that catches, and
/// whatever happens there, the lamps go dark. Every public function returns at once.
/// Thread-safe.
class Service {
public:
    Service(OpenRig open, ServiceOptions options, EventLog& log);
    Service(const Service&) = delete;
    Service& operator=(const Service&) = delete;
    /// Cancels what runs, and waits until the lamps are dark and the devices closed.
    ~Service();

    ServiceStatus status() const;
    /// Throws Refused, NotFound, or InputError for an order that makes no sense.
    Job start_capture(const CaptureOrder& order);
    Job job(std::uint64_t id) const;
    /// Asks the job to stop; a finished one is left as it is.
    Job cancel(std::uint64_t id);
    /// Darkens the lamps; a running capture is cancelled for it. The event "lamps" tells how it went.
    /// Returns the number after which that event comes. Throws Refused when Offline.
    std::uint64_t darken();
    const std::filesystem::path& sessions() const { return options_.sessions; }

    /// Cancels what runs and lets the thread end; the event log is closed when it did.
    void request_stop() noexcept;
    /// Stops and waits for the end; says why the lamps could not be proven dark, where they could not.
    std::optional<std::string> stop();

private:
    struct Capture {
        std::uint64_t job = 0;
        CaptureRequest request;
        std::stop_token stop;
    };
    struct Darken {};
    using Task = std::variant<Capture, Darken>;

    CaptureRequest request_for(const CaptureOrder& order) const;
    const Job& find(std::uint64_t id) const;
    void forget_old_jobs();

    void run(const std::stop_token& stop);
    bool open_rig(const std::stop_token& stop);
    std::optional<Task> next_task(const std::stop_token& stop);
    void perform(const Capture& capture);
    void perform(Darken);
    std::optional<Failure> darken_lamps();
    void report_progress(std::uint64_t id, const ProgressUpdate& update);
    void finish(Job job, const std::optional<Failure>& not_dark);
    void enter(ServiceState state, const std::string& problem);

    const OpenRig open_;
    const ServiceOptions options_;
    EventLog& log_;

    mutable std::mutex mutex_;
    std::condition_variable_any wake_;
    ServiceState state_ = ServiceState::offline;  // guarded by mutex_
    std::string problem_;                         // guarded by mutex_
    std::deque<Task> tasks_;                      // guarded by mutex_
    std::map<std::uint64_t, Job> jobs_;           // guarded by mutex_
    std::uint64_t running_ = 0;                   // guarded by mutex_; 0 = none
    std::stop_source job_stop_;                   // guarded by mutex_
    std::uint64_t last_job_ = 0;                  // guarded by mutex_
    bool stopping_ = false;                       // guarded by mutex_

    std::unique_ptr<CaptureRig> rig_;  // the thread's own
    std::optional<Failure> not_dark_;  // the thread's own until it was joined
    std::jthread thread_;              // last: ends before what it uses
};

}  // namespace darkbox
