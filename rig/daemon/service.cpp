#include "rig/daemon/service.h"

#include <fmt/format.h>

#include <algorithm>

#include "acquisition/frame/error.h"
#include "rig/daemon/session_folder.h"

namespace darkbox {
namespace {

constexpr const char* resume_hint = "what was captured is kept: resume it with darkbox capture --resume {}";

bool has_journal(const std::filesystem::path& session) {
    std::error_code ignored;
    return std::filesystem::exists(session / "journal.jsonl", ignored);
}

/// The remedy, and how to go on with what was captured.
std::string hint_for(const Failure& failure, const std::filesystem::path& session) {
    const std::string resume = fmt::format(fmt::runtime(resume_hint), session.filename().string());
    if (failure.cancelled || failure.hint.empty()) return resume;
    return has_journal(session) ? failure.hint + "; " + resume : failure.hint;
}

/// The single place of the daemon's work that catches: whatever goes wrong comes back as words.
std::optional<Failure> attempt(const std::function<void()>& work) noexcept {
    try {
        work();
        return std::nullopt;
    } catch (const Cancelled& stopped) {
        return Failure{.cancelled = true, .what = stopped.what(), .hint = stopped.hint()};
    } catch (const Error& error) {
        return Failure{.what = error.what(), .hint = error.hint()};
    } catch (const std::bad_alloc&) {
        return Failure{.what = "out of memory", .hint = "close other programs"};
    } catch (const std::exception& error) {
        return Failure{.what = error.what(), .hint = "this is a defect of darkbox; please report it"};
    } catch (...) {
        return Failure{.what = "unknown error", .hint = "this is a defect of darkbox; please report it"};
    }
}

std::string state_hint(ServiceState state, const std::string& problem) {
    switch (state) {
        case ServiceState::offline:
            return problem.empty() ? "the rig is being opened: try again in a moment" : problem;
        case ServiceState::idle:
            return "";
        case ServiceState::busy:
            return "wait for the running capture, or cancel it";
        case ServiceState::fault:
            break;
    }
    return problem + "; check the lamps, then darkbox lamps dark";
}

[[noreturn]] void refuse(ServiceState state, const std::string& problem) {
    throw Refused(fmt::format("the rig is {}", name(state)), state_hint(state, problem));
}

}  // namespace

Refused::~Refused() = default;
NotFound::~NotFound() = default;

std::string_view name(ServiceState state) {
    switch (state) {
        case ServiceState::offline:
            return "Offline";
        case ServiceState::idle:
            return "Idle";
        case ServiceState::busy:
            return "Busy";
        case ServiceState::fault:
            break;
    }
    return "Fault";
}

Service::Service(OpenRig open, ServiceOptions options, EventLog& log)
    : open_(std::move(open)),
      options_(std::move(options)),
      log_(log),
      thread_([this](const std::stop_token& stop) { run(stop); }) {}

Service::~Service() { request_stop(); }

std::optional<std::string> Service::stop() {
    request_stop();
    if (thread_.joinable()) thread_.join();
    return not_dark_ ? std::optional(not_dark_->what) : std::nullopt;
}

ServiceStatus Service::status() const {
    const std::scoped_lock lock(mutex_);
    ServiceStatus status{.state = state_, .problem = problem_, .last_event = log_.last()};
    if (running_ != 0) status.running = jobs_.at(running_);
    return status;
}

CaptureRequest Service::request_for(const CaptureOrder& order) const {
    const bool resumes = order.resume.has_value();
    if (resumes && !(order.name.empty() && order.object.empty()))
        throw InputError("a resumed session keeps its name and object", "give either \"resume\" or the others");
    const std::string session =
        resumes              ? *order.resume
        : order.name.empty() ? fresh_session_name(options_.sessions, order.object, std::chrono::system_clock::now())
                             : order.name;
    CaptureRequest request{.folder = session_path(options_.sessions, session),
                           .object = order.object,
                           .lamps = order.lamps,
                           .start = resumes ? CaptureStart::resume : CaptureStart::create,
                           .mode = order.mode};
    const bool there = std::filesystem::exists(request.folder);
    if (resumes && !there)
        throw NotFound(fmt::format("there is no session \"{}\"", session), "darkbox sessions lists them");
    if (!resumes && there)
        throw InputError(fmt::format("there is a session \"{}\" already", session),
                         "resume it, or choose another name");
    return request;
}

Job Service::start_capture(const CaptureOrder& order) {
    const std::scoped_lock lock(mutex_);
    if (stopping_) throw Refused("darkboxd is shutting down", "start it again");
    if (state_ != ServiceState::idle) refuse(state_, problem_);
    CaptureRequest request = request_for(order);
    const Job job{.id = ++last_job_, .session = request.folder.filename().string(), .event = log_.last()};
    jobs_.emplace(job.id, job);
    forget_old_jobs();
    running_ = job.id;
    job_stop_ = std::stop_source();
    tasks_.emplace_back(Capture{job.id, std::move(request), job_stop_.get_token()});
    enter(ServiceState::busy, "");
    wake_.notify_all();
    return job;
}

Job Service::job(std::uint64_t id) const {
    const std::scoped_lock lock(mutex_);
    return find(id);
}

Job Service::cancel(std::uint64_t id) {
    const std::scoped_lock lock(mutex_);
    const Job& job = find(id);
    if (job.id == running_) job_stop_.request_stop();
    return job;
}

std::uint64_t Service::darken() {
    const std::scoped_lock lock(mutex_);
    if (state_ == ServiceState::offline) refuse(state_, problem_);
    const std::uint64_t event = log_.last();
    if (state_ == ServiceState::busy) job_stop_.request_stop();
    tasks_.emplace_back(Darken{});  // also after a capture: its own darkening may have been told before `event`
    wake_.notify_all();
    return event;
}

void Service::request_stop() noexcept {
    {
        const std::scoped_lock lock(mutex_);
        stopping_ = true;
        job_stop_.request_stop();
    }
    thread_.request_stop();
}

const Job& Service::find(std::uint64_t id) const {
    const auto found = jobs_.find(id);
    if (found == jobs_.end())
        throw NotFound(fmt::format("there is no capture {}", id), "the daemon keeps the last ones only");
    return found->second;
}

void Service::forget_old_jobs() {
    while (jobs_.size() > options_.jobs_kept) jobs_.erase(jobs_.begin());
}

void Service::run(const std::stop_token& stop) {
    if (open_rig(stop)) {
        while (const auto task = next_task(stop)) std::visit([this](const auto& t) { perform(t); }, *task);
        not_dark_ = darken_lamps();
        rig_.reset();
    }
    log_.close();
}

bool Service::open_rig(const std::stop_token& stop) {
    while (!stop.stop_requested()) {
        const auto failure = attempt([this] { rig_ = open_(); });
        std::unique_lock lock(mutex_);
        if (!failure) {
            enter(ServiceState::idle, "");
            return true;
        }
        if (problem_ != failure->what) enter(ServiceState::offline, failure->what);
        wake_.wait_for(lock, stop, options_.reopen_every, [] { return false; });
    }
    return false;
}

std::optional<Service::Task> Service::next_task(const std::stop_token& stop) {
    std::unique_lock lock(mutex_);
    wake_.wait(lock, stop, [this] { return !tasks_.empty(); });
    // A capture that was accepted still ends as a job does, cancelled at once, so that its listeners hear of it.
    if (tasks_.empty()) return std::nullopt;
    Task task = std::move(tasks_.front());
    tasks_.pop_front();
    return task;
}

void Service::perform(const Capture& capture) {
    WorkContext work;
    work.stop = capture.stop;
    work.report = [&](const ProgressUpdate& update) { report_progress(capture.job, update); };
    Job ended = job(capture.job);
    const auto failure = attempt([&] {
        if (work.cancelled()) throw Cancelled("the capture was cancelled before it began", "");
        ended.outcome = rig_->capture(capture.request, work);
    });
    const auto not_dark = darken_lamps();
    ended.state = !failure ? JobState::done : failure->cancelled ? JobState::cancelled : JobState::failed;
    if (failure) ended.failure = *failure;
    if (failure) ended.failure.hint = hint_for(*failure, capture.request.folder);
    finish(std::move(ended), not_dark);
}

void Service::perform(Darken) {
    const auto not_dark = darken_lamps();
    const std::scoped_lock lock(mutex_);
    if (running_ != 0) return;  // a capture was accepted meanwhile and decides
    enter(not_dark ? ServiceState::fault : ServiceState::idle, not_dark ? not_dark->what : "");
}

std::optional<Failure> Service::darken_lamps() {
    auto failure = attempt([this] { rig_->dark(); });
    log_.publish("lamps", {{"dark", !failure}, {"detail", failure ? failure->what : "all lamps are dark"}});
    return failure;
}

void Service::report_progress(std::uint64_t id, const ProgressUpdate& update) {
    {
        const std::scoped_lock lock(mutex_);
        jobs_.at(id).progress = update;
    }
    log_.publish("progress", {{"capture", id},
                              {"stage", update.stage},
                              {"done", update.done},
                              {"total", update.total},
                              {"detail", update.detail}});
}

/// The job's last event comes after the state's, so that whoever hears it may ask for the next capture.
void Service::finish(Job job, const std::optional<Failure>& not_dark) {
    const std::scoped_lock lock(mutex_);
    job.progress = jobs_.at(job.id).progress;
    running_ = 0;
    enter(not_dark ? ServiceState::fault : ServiceState::idle, not_dark ? not_dark->what : "");
    nlohmann::json fields = to_json(job);
    fields["capture"] = job.id;
    log_.publish(std::string(name(job.state)), std::move(fields));
    jobs_.at(job.id) = std::move(job);
}

/// With mutex_ held.
void Service::enter(ServiceState state, const std::string& problem) {
    state_ = state;
    problem_ = problem;
    log_.publish("state", {{"state", name(state)}, {"problem", problem}});
}

}  // namespace darkbox
