#include "rig/daemon/service.h"

#include <fmt/format.h>

#include <algorithm>

#include "acquisition/frame/error.h"
#include "acquisition/session/bag.h"
#include "rig/capture/flat_frames.h"
#include "rig/daemon/attempt.h"
#include "rig/daemon/capture_order_json.h"
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

std::string state_hint(ServiceState state, const std::string& problem) {
    switch (state) {
        case ServiceState::offline:
            return problem.empty() ? "the rig is being opened: try again in a moment" : problem;
        case ServiceState::idle:
            return "";
        case ServiceState::busy:
            return "wait for the running capture, or cancel it; a lamp lit by hand ends with darkbox lamps dark";
        case ServiceState::fault:
            break;
    }
    return problem + "; check the lamps, then darkbox lamps dark";
}

/// A job keeps the rules it was asked for under.
void add_rules(const RetentionRules& rules, nlohmann::json& orders) {
    orders["keep_days"] = rules.keep_days;
    orders["keep_newest"] = rules.keep_newest;
    if (rules.free_gb) orders["free_gb"] = *rules.free_gb;
}

[[noreturn]] void refuse(ServiceState state, const std::string& problem) {
    throw Refused(fmt::format("the rig is {}", name(state)), state_hint(state, problem));
}

}  // namespace

Refused::~Refused() = default;
NoRoom::~NoRoom() = default;

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
      lock_(options_.sessions / Catalog::own_folder_name),
      catalog_(options_.sessions),
      book_(catalog_, log_, options_.jobs_kept),
      processing_(book_, catalog_, options_.run_processing),
      thread_([this](const std::stop_token& stop) { run(stop); }) {}

Service::~Service() { request_stop(); }

std::optional<std::string> Service::stop() {
    request_stop();
    if (thread_.joinable()) thread_.join();
    return not_dark_ ? std::optional(not_dark_->what) : std::nullopt;
}

ServiceStatus Service::status() const {
    const std::scoped_lock lock(mutex_);
    ServiceStatus status{.state = state_, .problem = problem_, .last_event = log_.last(), .lamps = lamps_};
    if (running_ != 0) status.running = book_.find(running_);
    status.queued = book_.unfinished(Lane::rig) - (running_ != 0 ? 1 : 0);
    status.processing = book_.unfinished(Lane::processing);
    return status;
}

CaptureRequest Service::request_for(const CaptureOrder& order, int attempt) const {
    const bool resumes = order.resume.has_value();
    const bool lit = order.kind == FrameKind::lit;
    if (resumes && !(order.name.empty() && order.object.empty() && order.record.empty() && !order.retake &&
                     !order.exposure && !order.flats_from && lit))
        throw InputError("a resumed session keeps its name, object and plan", "give either \"resume\" or the others");
    if (order.retake && order.exposure)
        throw InputError("a re-take keeps its session's exposure", "leave out \"exposure\"");
    if (order.retake && (order.flats_from || !lit))
        throw InputError("a re-take keeps its session's flat frames", "leave out \"plan\" and \"flats_from\"");
    const std::string label = !order.object.empty() ? order.object : lit ? order.retake.value_or("") : flat_object;
    const std::string session = resumes ? *order.resume
                                : order.name.empty()
                                    ? fresh_session_name(options_.sessions, label, std::chrono::system_clock::now())
                                    : order.name;
    CaptureRequest request{.folder = session_path(options_.sessions, session),
                           .object = order.object,
                           .lamps = order.lamps,
                           .start = resumes ? CaptureStart::resume : CaptureStart::create,
                           .mode = order.mode};
    request.record = order.record;
    request.exposure = order.exposure;
    request.kind = order.kind;
    const auto sealed = [&](const std::optional<std::string>& name) -> std::optional<std::filesystem::path> {
        if (!name) return std::nullopt;
        auto folder = session_path(options_.sessions, *name);
        if (!is_sealed(folder))
            throw NotFound(fmt::format("there is no sealed session \"{}\"", *name), "darkbox sessions lists them");
        return folder;
    };
    request.retake = sealed(order.retake);
    request.flats = sealed(order.flats_from);
    const bool there = std::filesystem::exists(request.folder);
    if (resumes && !there)
        throw NotFound(fmt::format("there is no session \"{}\"", session), "darkbox sessions lists them");
    // After a crash its own folder may be there, with nothing in it yet.
    if (!resumes && there && attempt <= 1)
        throw InputError(fmt::format("there is a session \"{}\" already", session),
                         "resume it, or choose another name");
    return request;
}

void Service::require_room(const CaptureOrder& order) const {
    if (!options_.bytes_needed) return;
    constexpr double mebibyte = 1 << 20;
    const auto needed = options_.bytes_needed(order) + options_.bytes_kept_free;
    std::error_code error;
    const auto free = std::filesystem::space(options_.sessions, error).available;
    if (error || free >= needed) return;
    throw NoRoom(
        fmt::format("the capture could not end: it needs up to {:.0f} MiB in {}, where {:.0f} MiB are free",
                    static_cast<double>(needed) / mebibyte, options_.sessions.string(),
                    static_cast<double>(free) / mebibyte),
        "free space there: darkbox sessions lists what may be archived elsewhere; a camera whose width and height "
        "rig.toml does not say is taken for one of 24 megapixels");
}

Job Service::start_capture(const CaptureOrder& order) {
    const std::scoped_lock lock(mutex_);
    if (stopping_) throw Refused("darkboxd is shutting down", "start it again");
    if (state_ != ServiceState::idle) refuse(state_, problem_);
    const CaptureRequest request = request_for(order, 1);
    require_room(order);
    Job job;
    job.session = request.folder.filename().string();
    job.state = JobState::running;
    job.orders = to_json(order);
    job = book_.add(std::move(job));
    running_ = job.id;
    tasks_.emplace_back(job);
    enter(ServiceState::busy, "");
    wake_.notify_all();
    return job;
}

Job Service::enqueue(Job job) {
    const std::scoped_lock lock(mutex_);
    if (stopping_) throw Refused("darkboxd is shutting down", "start it again");
    if (lane_of(job.kind) == Lane::rig) {
        if (job.kind == JobKind::recalibrate && !job.orders.contains("object") && !job.orders.contains("resume"))
            job.orders["object"] = recalibration_object;
        const CaptureOrder order = capture_order_from(job.orders);
        if (job.kind == JobKind::recalibrate && order.kind == FrameKind::flat)
            throw InputError("a recalibration needs frames of the ball, not of a card", "leave out \"plan\"");
        (void)request_for(order, 1);
    } else if (!options_.run_processing) {
        throw Refused("this darkboxd does not process", "process with the command: darkbox process SESSION");
    } else if (job.kind == JobKind::prune) {
        if (!options_.retention)
            throw Refused("rig.toml has no [retention], so sessions are never removed", "add one with keep_days = 90");
        add_rules(*options_.retention, job.orders);
    } else if (!is_sealed(session_path(options_.sessions, job.session))) {
        throw NotFound(fmt::format("there is no sealed session \"{}\"", job.session), "darkbox sessions lists them");
    }
    job = book_.add(std::move(job));
    wake_.notify_all();
    return job;
}

std::uint64_t Service::darken() {
    const std::scoped_lock lock(mutex_);
    if (state_ == ServiceState::offline) refuse(state_, problem_);
    const std::uint64_t event = log_.last();
    if (running_ != 0) book_.cancel(running_);
    if (hand_light_) hand_light_->request_stop();
    tasks_.emplace_back(Darken{});  // also after a capture: its own darkening may have been told before `event`
    wake_.notify_all();
    return event;
}

std::uint64_t Service::light(const HandLight& light) {
    const std::scoped_lock lock(mutex_);
    if (stopping_) throw Refused("darkboxd is shutting down", "start it again");
    if (state_ != ServiceState::idle) refuse(state_, problem_);
    if (!options_.shine) throw Refused("this darkboxd lights no lamps by hand", "capture instead");
    const std::uint64_t event = log_.last();
    hand_light_.emplace();
    tasks_.emplace_back(light);
    enter(ServiceState::busy, "");
    wake_.notify_all();
    return event;
}

void Service::request_stop() noexcept {
    {
        const std::scoped_lock lock(mutex_);
        stopping_ = true;
        if (hand_light_) hand_light_->request_stop();
    }
    book_.cancel_running(Lane::rig);
    processing_.request_stop();
    thread_.request_stop();
}

void Service::run(const std::stop_token& stop) {
    if (open_rig(stop)) {
        look_at_lamps();
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
    const auto may_take = [this] { return state_ == ServiceState::idle && !stopping_ && book_.has_queued(Lane::rig); };
    while (true) {
        while (!wake_.wait_for(lock, stop, options_.look_every, [&] { return !tasks_.empty() || may_take(); }) &&
               !stop.stop_requested()) {
            lock.unlock();
            look_at_lamps();
            lock.lock();
        }
        // A capture that was accepted still ends as a job does, cancelled at once, so that its listeners hear of it.
        if (!tasks_.empty()) {
            Task task = std::move(tasks_.front());
            tasks_.pop_front();
            return task;
        }
        if (!may_take()) return std::nullopt;
        if (auto job = take_queued()) return std::move(*job);
        // A disk that refuses to keep that the job begins may take it in a moment.
        wake_.wait_for(lock, stop, options_.reopen_every, [this] { return !tasks_.empty(); });
    }
}

/// With mutex_ held.
std::optional<Job> Service::take_queued() {
    std::optional<Job> job;
    if (const auto failure = attempt([&] { job = book_.take(Lane::rig); }))
        log_.publish("problem", {{"detail", failure->what}, {"hint", failure->hint}});
    if (!job) return std::nullopt;
    running_ = job->id;
    enter(ServiceState::busy, "");
    return job;
}

/// For the log, and the job's own.
CaptureListener Service::listener_for(const Job& job) {
    const LogFields whose{{"job", std::to_string(job.id)}, {"session", job.session}};
    return {.frame =
                [this, whose](const FrameRecord& record) {
                    LogFields fields = whose;
                    if (record.lamp) fields.emplace_back("lamp", record.lamp_name);
                    fields.emplace_back("frame", std::filesystem::path(record.file).stem().string());
                    fields.emplace_back("sequence", std::to_string(record.sequence));
                    options_.log({LogLevel::info, "frame taken", std::move(fields)});
                },
            .event =
                [this, whose, id = job.id](const std::string& what) {
                    options_.log({LogLevel::notice, what, whose});
                    book_.note(id, what);
                }};
}

void Service::capture(Job& job, const WorkContext& work) {
    if (work.cancelled()) throw Cancelled("the capture was cancelled before it began", "");
    CaptureOrder order = capture_order_from(job.orders);
    if (!order.resume && !job.session.empty()) order.name = job.session;
    // A session of its own that start_capture() has just named is not there yet; after a crash it may be.
    CaptureRequest request = request_for(order, job.attempts);
    job.session = request.folder.filename().string();
    require_room(order);
    book_.set_session(job.id, job.session);
    request.listener = listener_for(job);
    job.outcome = rig_->capture(request, work);
    frames_captured_ += job.outcome.frames;
    exposures_repeated_ += static_cast<std::uint64_t>(job.outcome.repeated);
}

void Service::perform(const Job& begun) {
    Job job = begun;
    WorkContext work;
    work.stop = book_.stop_token(job.id);
    work.report = [&](const ProgressUpdate& update) {
        book_.progress(job.id, update);
        book_.note(job.id, fmt::format("{} {}/{} {}", update.stage, update.done, update.total, update.detail));
    };
    const auto failure = attempt([&] { capture(job, work); });
    const auto not_dark = darken_lamps();
    job.state = !failure ? JobState::done : failure->cancelled ? JobState::cancelled : JobState::failed;
    if (failure) job.failure = *failure;
    if (failure) job.failure.hint = hint_for(*failure, options_.sessions / job.session);
    look_at_lamps();
    finish(std::move(job), not_dark);
}

void Service::perform(Darken) {
    const auto not_dark = darken_lamps();
    const std::scoped_lock lock(mutex_);
    if (running_ != 0 || hand_light_) return;  // a capture was accepted meanwhile, or a lamp to be lit, and decides
    enter(not_dark ? ServiceState::fault : ServiceState::idle, not_dark ? not_dark->what : "");
}

void Service::perform(const HandLight& light) {
    WorkContext work;
    {
        const std::scoped_lock lock(mutex_);
        work.stop = hand_light_->get_token();
    }
    const auto failure =
        attempt([&] { rig_->lend([&](const LentDevices& devices) { options_.shine(light, devices, work); }); });
    const auto not_dark = darken_lamps();
    look_at_lamps();
    const std::scoped_lock lock(mutex_);
    hand_light_.reset();
    enter(not_dark ? ServiceState::fault : ServiceState::idle, not_dark ? not_dark->what : "");
    log_.publish("light", {{"lit", !failure},
                           {"detail", failure ? failure->what : "the lamp was lit; all lamps are dark"},
                           {"hint", failure ? failure->hint : ""}});
}

std::optional<Failure> Service::darken_lamps() {
    auto failure = attempt([this] { rig_->dark(); });
    log_.publish("lamps", {{"dark", !failure}, {"detail", failure ? failure->what : "all lamps are dark"}});
    return failure;
}

/// What is new about them is told once.
void Service::look_at_lamps() {
    LampHealth seen;
    const auto failure = attempt([&] { seen = rig_->health(); });
    if (failure) seen = {.reachable = false, .problems = {failure->what}};
    const std::scoped_lock lock(mutex_);
    for (const std::string& problem : seen.problems)
        if (std::ranges::find(lamps_.problems, problem) == lamps_.problems.end())
            log_.publish("problem", {{"detail", problem}, {"hint", "darkbox rig status tells when it is over"}});
    lamps_ = std::move(seen);
}

/// The job's last event comes after the state's, so that whoever hears it may ask for the next capture.
void Service::finish(Job job, const std::optional<Failure>& not_dark) {
    // What the catalogue cannot take now it reads when it next looks.
    if (!job.session.empty()) (void)attempt([&] { catalog_.refresh(job.session); });
    const std::scoped_lock lock(mutex_);
    running_ = 0;
    enter(not_dark ? ServiceState::fault : ServiceState::idle, not_dark ? not_dark->what : "");
    book_.finish(std::move(job));
}

/// With mutex_ held.
void Service::enter(ServiceState state, const std::string& problem) {
    state_ = state;
    problem_ = problem;
    log_.publish("state", {{"state", name(state)}, {"problem", problem}});
}

}  // namespace darkbox
