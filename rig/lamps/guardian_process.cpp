#include "rig/lamps/guardian_process.h"

#include <fcntl.h>
#include <poll.h>
#include <sys/prctl.h>
#include <sys/signalfd.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <csignal>
#include <limits>

#include "acquisition/device/device_error.h"
#include "rig/lamps/guardian.h"

namespace darkbox {
namespace {

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

/// What ends other programs does not end this one, the two signals aside by which it may be asked to.
void outlive_the_daemon() {
    for (const int number : {SIGHUP, SIGQUIT, SIGPIPE, SIGUSR1, SIGUSR2}) std::signal(number, SIG_IGN);
    ::prctl(PR_SET_NAME, "darkbox-guard");
    const UniqueFd score(::open("/proc/self/oom_score_adj", O_WRONLY | O_CLOEXEC));
    // Needs privileges; without them the guardian is still the smaller of the two.
    [[maybe_unused]] const ssize_t ignored = score ? ::write(score.get(), "-1000", 5) : 0;
}

bool may_command(const UniqueFd& channel) {
    ucred peer{};
    socklen_t size = sizeof peer;
    return ::getsockopt(channel.get(), SOL_SOCKET, SO_PEERCRED, &peer, &size) == 0 &&
           (peer.uid == 0 || peer.uid == ::geteuid());
}

bool greet(const UniqueFd& channel, const GuardianGreeting& greeting) {
    constexpr int flags = MSG_NOSIGNAL | MSG_DONTWAIT;
    return ::send(channel.get(), &greeting, sizeof greeting, flags) == static_cast<ssize_t>(sizeof greeting);
}

/// Whoever waits next. No descriptor where it may not command, or another does already.
UniqueFd next_daemon(const UniqueFd& listening, const UniqueFd& present) {
    UniqueFd channel(::accept4(listening.get(), nullptr, nullptr, SOCK_CLOEXEC));
    if (!channel || !may_command(channel)) return UniqueFd();
    if (present) {
        greet(channel,
              {.reply = guardian_refusal("another darkbox program drives the lamps", "stop it, or have it do this")});
        return UniqueFd();
    }
    return greet(channel, {.process = ::getpid()}) ? std::move(channel) : UniqueFd();
}

UniqueFd request_to_end() {
    sigset_t ends{};
    ::sigemptyset(&ends);
    ::sigaddset(&ends, SIGTERM);
    ::sigaddset(&ends, SIGINT);
    ::sigprocmask(SIG_BLOCK, &ends, nullptr);
    UniqueFd signals(::signalfd(-1, &ends, SFD_CLOEXEC | SFD_NONBLOCK));
    if (!signals) throw_errno("signalfd", "of the lamps' guardian", errno);
    return signals;
}

/// The kernel's word, however much of what it said is still to be heard: nothing of that is worth obeying.
bool has_left(int daemon) {
    pollfd look{.fd = daemon, .events = POLLRDHUP, .revents = 0};
    return ::poll(&look, 1, 0) > 0;
}

void guard(int daemon, const RequestLines& request_lines, Nanoseconds silence) {
    Guardian guardian(request_lines, silence);
    while (true) {
        pollfd wait{.fd = daemon, .events = POLLIN, .revents = 0};
        if (::poll(&wait, 1, guardian.milliseconds_left()) < 0) wait.revents = 0;
        if (has_left(daemon) || (wait.revents != 0 && !guardian.hear(daemon))) return;
        guardian.darken_when_overdue();
    }
}

}  // namespace

void guard_lamps(UniqueFd channel, const RequestLines& request_lines, Nanoseconds silence) noexcept {
    ::setsid();
    outlive_the_daemon();
    for (const int number : {SIGTERM, SIGINT}) std::signal(number, SIG_IGN);
    try {
        guard(keep_only(channel), request_lines, silence);
    } catch (...) {  // NOLINT(bugprone-empty-catch): the lamps are dark by now, and nobody is there to be told
    }
    ::_exit(0);
}

void serve_guardian(UniqueFd listening, const RequestLines& request_lines, Nanoseconds silence) {
    outlive_the_daemon();
    const UniqueFd end = request_to_end();
    ::fcntl(listening.get(), F_SETFL, O_NONBLOCK);
    UniqueFd daemon;
    Guardian guardian(request_lines, silence);  // darkens, if need be, before the daemon is hung up on
    bool asked_to_end = false;
    while (daemon || !asked_to_end) {
        std::array wait{pollfd{daemon.get(), POLLIN, 0}, pollfd{listening.get(), POLLIN, 0},
                        pollfd{asked_to_end ? -1 : end.get(), POLLIN, 0}};
        if (::poll(wait.data(), wait.size(), guardian.milliseconds_left()) < 0) wait = {};
        if (daemon && (has_left(daemon.get()) || (wait[0].revents != 0 && !guardian.hear(daemon.get())))) {
            guardian.darken();
            daemon.reset();  // which tells a daemon that waits for it that the lamps are dark
        }
        guardian.darken_when_overdue();
        if (wait[1].revents != 0) {
            UniqueFd next = next_daemon(listening, daemon);
            if (!daemon) daemon = std::move(next);
        }
        if (wait[2].revents != 0) asked_to_end = true;
    }
}

}  // namespace darkbox
