#include "rig/lamps/guardian_process.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <limits>
#include <string>

#include "acquisition/device/clock.h"
#include "acquisition/device/device_error.h"

namespace darkbox {
namespace {

template <std::size_t Size>
void put(const std::string& text, std::array<char, Size>& field) {
    text.copy(field.data(), Size - 1);
}

class Guardian {
public:
    Guardian(int channel, const GpioRequest& request, const RequestLines& request_lines, Nanoseconds silence)
        : channel_(channel), request_(request), request_lines_(request_lines), silence_(silence) {}

    /// Until the channel closes.
    void run() {
        while (hear()) darken_when_overdue();
        darken();
    }

private:
    /// Waits for a command, or for the moment when the lamps must be dark without one.
    bool hear() {
        pollfd wait{.fd = channel_, .events = POLLIN, .revents = 0};
        const int ready = ::poll(&wait, 1, milliseconds_left());
        if (ready <= 0) return ready == 0 || errno == EINTR;
        GuardianCommand command;
        const ssize_t size = ::recv(channel_, &command, sizeof command, 0);
        if (size < 0 && errno == EINTR) return true;
        if (size != static_cast<ssize_t>(sizeof command)) return false;
        heard_ = clock_.now();
        return command.kind == GuardianCommand::Kind::beat || answer(command);
    }

    bool answer(const GuardianCommand& command) {
        GuardianReply reply;
        try {
            obey(command);
        } catch (const Error& error) {
            reply.failed = 1;
            put(error.what(), reply.what);
            put(error.hint(), reply.hint);
        } catch (const std::exception& error) {
            reply.failed = 1;
            put(error.what(), reply.what);
        }
        return ::send(channel_, &reply, sizeof reply, MSG_NOSIGNAL) == static_cast<ssize_t>(sizeof reply);
    }

    void obey(const GuardianCommand& command) {
        if (command.kind == GuardianCommand::Kind::open) {
            lines_.reset();
            lit_ = 0;
            forced_.clear();
            lines_ = request_lines_(request_);
        } else if (command.kind == GuardianCommand::Kind::drive) {
            drive(command);
        } else {
            need_lines();
            if (!forced_.empty()) refuse_forced();
        }
    }

    void need_lines() const {
        if (lines_) return;
        throw DeviceError(fmt::format("the lines of GPIO chip \"{}\" are not open", request_.chip),
                          "check the chip's cable, then darkbox lamps dark opens them again");
    }

    void drive(const GuardianCommand& command) {
        need_lines();
        const std::size_t steps = std::min<std::size_t>(command.steps, GuardianCommand::most_steps);
        const std::uint64_t last = steps == 0 || command.at_most_ns <= 0 ? 0 : command.step.at(steps - 1);
        if (last == 0)
            forced_.clear();
        else if (!forced_.empty())
            refuse_forced();
        const TimePoint until = clock_.now() + Nanoseconds(command.at_most_ns);
        // Lit again is lit on: the time that a lamp may burn is counted from when it was dark.
        lit_until_ = last != 0 && last == lit_ ? std::min(lit_until_, until) : until;
        lit_ = last == 0 ? lit_ : last;  // before the lines change: a failure must find it
        for (std::size_t i = 0; i < steps; ++i) set(command.step.at(i));
        if (last == 0) darken_or_throw();
    }

    void set(std::uint64_t step) {
        std::vector<bool> active(request_.lines.size());
        for (std::size_t i = 0; i < active.size(); ++i) active[i] = ((step >> i) & 1U) != 0;
        try {
            lines_->set(active);
        } catch (...) {
            lines_.reset();  // opened anew, also after a replug, they start dark
            lit_ = 0;
            throw;
        }
    }

    void darken_or_throw() {
        set(0);
        lit_ = 0;
    }

    void darken() noexcept {
        try {
            if (lines_) darken_or_throw();
        } catch (...) {  // NOLINT(bugprone-empty-catch): the chip is gone, and with it what could be done
        }
    }

    TimePoint overdue_at() const { return std::min(lit_until_, heard_ + silence_); }

    int milliseconds_left() const {
        if (lit_ == 0) return -1;
        const auto left = std::chrono::ceil<std::chrono::milliseconds>(overdue_at() - clock_.now()).count();
        return static_cast<int>(std::clamp<std::int64_t>(left, 0, std::numeric_limits<int>::max()));
    }

    void darken_when_overdue() {
        const TimePoint now = clock_.now();
        if (lit_ == 0 || now < overdue_at()) return;
        forced_ = now >= lit_until_ ? "a lamp was lit for longer than its max_on_s, and was darkened"
                                    : "the program that drives the lamps fell silent, and they were darkened";
        darken();
    }

    [[noreturn]] void refuse_forced() const {
        throw DeviceError(forced_, "darkbox lamps dark, then go on; raise max_on_s if the lamp bears it");
    }

    const int channel_;
    const GpioRequest& request_;
    const RequestLines& request_lines_;
    const Nanoseconds silence_;
    SystemClock clock_;
    std::unique_ptr<OutputLines> lines_;
    std::uint64_t lit_ = 0;  ///< the step that is on; 0: dark
    TimePoint lit_until_;
    TimePoint heard_;
    std::string forced_;  ///< why the guardian darkened the lamps; empty: it did not
};

/// Nothing of the parent's stays open here: a socket or a pipe held by the guardian would hide the parent's death from
/// whoever waits for it. Returns where the channel is now.
int keep_only(const UniqueFd& channel) {
    constexpr int kept = 3;
    if (channel.get() != kept) ::dup2(channel.get(), kept);
    ::fcntl(kept, F_SETFD, FD_CLOEXEC);
    ::close_range(kept + 1, std::numeric_limits<unsigned int>::max(), 0);
    const int nothing = ::open("/dev/null", O_RDWR | O_CLOEXEC);
    for (int standard = 0; standard < kept; ++standard) ::dup2(nothing, standard);
    ::close(nothing);
    return kept;
}

void outlive_the_daemon() {
    for (const int number : {SIGTERM, SIGINT, SIGHUP, SIGQUIT, SIGPIPE, SIGUSR1, SIGUSR2}) std::signal(number, SIG_IGN);
    ::prctl(PR_SET_NAME, "darkbox-guard");
    const UniqueFd score(::open("/proc/self/oom_score_adj", O_WRONLY | O_CLOEXEC));
    // Needs privileges; without them the guardian is still the smaller of the two.
    [[maybe_unused]] const ssize_t ignored = score ? ::write(score.get(), "-1000", 5) : 0;
}

}  // namespace

void guard_lamps(UniqueFd channel, const GpioRequest& request, const RequestLines& request_lines,
                 Nanoseconds silence) noexcept {
    ::setsid();
    outlive_the_daemon();
    Guardian(keep_only(channel), request, request_lines, silence).run();
    ::_exit(0);
}

}  // namespace darkbox
