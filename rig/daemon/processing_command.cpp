#include "rig/daemon/processing_command.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <sched.h>
#include <sys/prctl.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <chrono>
#include <csignal>

#include "acquisition/device/device_error.h"
#include "acquisition/device/unique_fd.h"

namespace darkbox {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;
using JobClock = std::chrono::steady_clock;

constexpr auto patience = std::chrono::seconds(10);  ///< between asking it to end and killing it
constexpr int poll_ms = 100;
constexpr std::size_t longest_output = 4 * 1024 * 1024;  ///< bytes
constexpr const char* progress_mark = "progress ";

// <linux/ioprio.h>, which some releases of the kernel's headers do not offer to C++.
constexpr int ioprio_of_process = 1;
constexpr int ioprio_idle = 3 << 13;

struct Pipe {
    UniqueFd read, write;
};

Pipe make_pipe() {
    std::array<int, 2> ends{};
    if (::pipe2(ends.data(), O_CLOEXEC) != 0) throw_errno("pipe2", "for a processing job", errno);
    return {UniqueFd(ends[0]), UniqueFd(ends[1])};
}

/// In the child, between fork and exec, where only what is safe in a signal handler may be called.
/// The daemon's descriptors go first, while this still runs as fast as the daemon: in the idle class a killed process
/// can take seconds to end on a busy machine, and a restarted daemon would find socket and lock still held.
[[noreturn]] void become(char* const* arguments, int out, int err, pid_t parent) {
    const int nothing = ::open("/dev/null", O_RDONLY | O_CLOEXEC);
    ::dup2(nothing, STDIN_FILENO);
    ::dup2(out, STDOUT_FILENO);
    ::dup2(err, STDERR_FILENO);
    ::close_range(STDERR_FILENO + 1, ~0U, 0);
    ::prctl(PR_SET_PDEATHSIG, SIGKILL);
    if (::getppid() != parent) ::_exit(127);
    const sched_param none{};
    ::sched_setscheduler(0, SCHED_IDLE, &none);
    ::syscall(SYS_ioprio_set, ioprio_of_process, 0, ioprio_idle);
    sigset_t all;
    ::sigfillset(&all);
    ::sigprocmask(SIG_UNBLOCK, &all, nullptr);
    ::execv(arguments[0], arguments);
    ::_exit(127);
}

/// A running command. The destructor kills it.
class Command {
public:
    explicit Command(std::vector<std::string> arguments) : program_(arguments.front()) {
        Pipe out = make_pipe();
        Pipe err = make_pipe();
        std::vector<char*> raw;
        for (std::string& argument : arguments) raw.push_back(argument.data());
        raw.push_back(nullptr);
        const pid_t parent = ::getpid();
        pid_ = ::fork();
        if (pid_ < 0) throw_errno("fork", program_, errno);
        if (pid_ == 0) become(raw.data(), out.write.get(), err.write.get(), parent);
        out_ = std::move(out.read);
        err_ = std::move(err.read);
    }
    Command(const Command&) = delete;
    Command& operator=(const Command&) = delete;
    ~Command() {
        if (pid_ <= 0) return;
        ::kill(pid_, SIGKILL);
        ::waitpid(pid_, nullptr, 0);
    }

    void signal(int number) const { ::kill(pid_, number); }
    int out() const { return out_.get(); }
    int err() const { return err_.get(); }
    /// After both outputs ended.
    int wait() {
        int status = 0;
        while (::waitpid(pid_, &status, 0) < 0 && errno == EINTR) {
        }
        pid_ = -1;
        return status;
    }

private:
    std::string program_;
    pid_t pid_ = -1;
    UniqueFd out_, err_;
};

/// Whether there may be more.
bool read_some(int fd, std::string& text) {
    std::array<char, 16384> buffer{};
    const ssize_t got = ::read(fd, buffer.data(), buffer.size());
    if (got < 0) return errno == EINTR;
    if (text.size() < longest_output) text.append(buffer.data(), static_cast<std::size_t>(got));
    return got > 0;
}

void tell_line(const std::string& line, const WorkContext& work, const std::function<void(const std::string&)>& note) {
    if (!line.starts_with(progress_mark)) return line.empty() ? void() : note(line);
    const Json json = Json::parse(line.substr(std::char_traits<char>::length(progress_mark)), nullptr, false);
    if (!json.is_object()) return note(line);
    work.tell({json.value("stage", ""), json.value("done", std::size_t{0}), json.value("total", std::size_t{0}),
               json.value("detail", "")});
}

void take_lines(std::string& text, const std::function<void(const std::string&)>& tell) {
    for (std::size_t end = text.find('\n'); end != text.npos; end = text.find('\n')) {
        tell(text.substr(0, end));
        text.erase(0, end + 1);
    }
}

/// Reads both outputs to their ends; asks the command to end, and then makes it, when the context is cancelled.
std::string follow(Command& command, const WorkContext& work, const std::function<void(const std::string&)>& note) {
    std::string out;
    std::string err;
    std::optional<JobClock::time_point> asked;
    std::array<pollfd, 2> ends{pollfd{command.out(), POLLIN, 0}, pollfd{command.err(), POLLIN, 0}};
    while (ends[0].fd >= 0 || ends[1].fd >= 0) {
        ::poll(ends.data(), ends.size(), poll_ms);
        if (ends[0].revents != 0 && !read_some(ends[0].fd, out)) ends[0].fd = -1;
        if (ends[1].revents != 0 && !read_some(ends[1].fd, err)) ends[1].fd = -1;
        take_lines(err, [&](const std::string& line) { tell_line(line, work, note); });
        if (!work.cancelled()) continue;
        if (!asked) {
            asked = JobClock::now();
            command.signal(SIGTERM);
        } else if (JobClock::now() - *asked > patience) {
            command.signal(SIGKILL);
        }
    }
    if (!err.empty()) note(err);
    return out;
}

Json result_of(int status, const std::string& out, const std::string& what, bool cancelled) {
    const Json json = Json::parse(out, nullptr, false);
    if (WIFEXITED(status) && WEXITSTATUS(status) == 0 && json.is_object()) return json;
    if (cancelled) throw Cancelled(what + " was cancelled", "ask for it again: what was made stays");
    if (json.is_object() && json.contains("error"))
        throw InputError(json.value("error", ""), json.value("hint", std::string()));
    if (WIFSIGNALED(status))
        throw DeviceError(fmt::format("{} was ended by signal {}", what, WTERMSIG(status)),
                          WTERMSIG(status) == SIGKILL ? "is there enough memory?" : "please report this defect");
    throw DeviceError(fmt::format("{} ended with status {}", what, WIFEXITED(status) ? WEXITSTATUS(status) : -1),
                      "look into the job's log");
}

}  // namespace

namespace {

/// `folder` holds the sessions.
std::vector<std::string> pruning_arguments(const Job& job, const fs::path& folder) {
    std::vector<std::string> arguments{"sessions",         "prune",       "--folder", folder.string(), "--json",
                                       "--progress-lines", "--for-daemon"};
    for (const auto& [key, option] : {std::pair{"keep_days", "--keep-days"}, std::pair{"keep_newest", "--keep-newest"},
                                      std::pair{"free_gb", "--free-gb"}})
        if (const auto found = job.orders.find(key); found != job.orders.end())
            arguments.insert(arguments.end(), {option, found->dump()});
    if (job.orders.value("dry_run", false)) arguments.emplace_back("--dry-run");
    for (const auto& name : job.orders.value("keep", std::vector<std::string>()))
        arguments.insert(arguments.end(), {"--keep", name});
    return arguments;
}

}  // namespace

std::vector<std::string> processing_arguments(const Job& job, const fs::path& session) {
    if (job.kind == JobKind::prune) return pruning_arguments(job, session);
    std::vector<std::string> arguments{std::string(name(job.kind)), session.string(), "--json", "--progress-lines"};
    if (job.kind != JobKind::export_map) return arguments;
    const std::string format = job.orders.value("format", "");
    const auto target = export_target(format);
    if (!target) throw InputError(fmt::format("unknown format \"{}\"", format), "darkbox export --help lists them");
    arguments.insert(arguments.end(), {"--format", format, "--out", (session / "exports" / *target).string()});
    return arguments;
}

RunProcessing processing_by(const fs::path& program) {
    return [program](const Job& job, const fs::path& session, const WorkContext& work,
                     const std::function<void(const std::string&)>& note) {
        auto arguments = processing_arguments(job, session);
        arguments.insert(arguments.begin(), program.string());
        Command command(std::move(arguments));
        const std::string out = follow(command, work, note);
        const int status = command.wait();
        return result_of(status, out, fmt::format("{} of {}", name(job.kind), job.session), work.cancelled());
    };
}

fs::path darkbox_beside_this_program() {
    std::error_code ignored;
    return fs::read_symlink("/proc/self/exe", ignored).parent_path() / "darkbox";
}

}  // namespace darkbox
