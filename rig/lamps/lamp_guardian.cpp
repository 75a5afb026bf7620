#include "rig/lamps/lamp_guardian.h"

#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <condition_variable>
#include <csignal>
#include <stdexcept>

#include "acquisition/device/device_error.h"
#include "rig/lamps/guardian_process.h"

namespace darkbox {
namespace {

constexpr auto try_again_after = std::chrono::milliseconds(10);
constexpr int tries = 200;

/// A guardian that does not end within this time hangs in its driver: it is left to darken the lamps when it can.
void await_end(pid_t pid) {
    for (int i = 0; i < tries; ++i) {
        const pid_t ended = ::waitpid(pid, nullptr, WNOHANG);
        if (ended == pid || (ended < 0 && errno != EINTR)) return;
        std::this_thread::sleep_for(try_again_after);
    }
}

/// It hangs up once the lamps are dark.
void await_hanging_up(const UniqueFd& channel, Nanoseconds most) {
    ::shutdown(channel.get(), SHUT_WR);
    await_packet(channel, most);
}

}  // namespace

LampGuardian::LampGuardian(GpioRequest request, RequestLines request_lines, GuardianOptions options)
    : request_(std::move(request)),
      opening_(guardian_opening(request_)),
      request_lines_(std::move(request_lines)),
      options_(options),
      own_(true) {
    std::array<int, 2> ends{};
    if (::socketpair(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0, ends.data()) != 0)
        throw_errno("socketpair", "of the lamps' guardian", errno);
    channel_.reset(ends[0]);
    UniqueFd theirs(ends[1]);
    pid_ = ::fork();
    if (pid_ < 0) throw_errno("fork", "of the lamps' guardian", errno);
    if (pid_ == 0) {
        channel_.reset();
        guard_lamps(std::move(theirs), request_lines_, options_.silence);
    }
}

LampGuardian::LampGuardian(GpioRequest request, RequestLines request_lines, GuardianConnection guardian,
                           GuardianOptions options)
    : request_(std::move(request)),
      opening_(guardian_opening(request_)),
      request_lines_(std::move(request_lines)),
      options_(options),
      channel_(std::move(guardian.channel)),
      pid_(guardian.process) {}

LampGuardian::~LampGuardian() {
    beat_.request_stop();
    if (beat_.joinable()) beat_.join();
    if (channel_ && !own_) await_hanging_up(channel_, options_.reply_within);
    channel_.reset();
    if (own_) await_end(pid_);
}

void LampGuardian::open() {
    tell(std::as_bytes(std::span(&opening_, 1)), Aim::other);
    if (!beat_.joinable()) beat_ = std::jthread([this](const std::stop_token& stop) { beat(stop); });
}

void LampGuardian::drive(const std::vector<std::uint64_t>& steps, Nanoseconds at_most) {
    GuardianCommand command{.kind = GuardianCommand::Kind::drive, .at_most_ns = at_most.count()};
    if (steps.size() > command.step.size()) throw std::logic_error("too many steps for the lamps' guardian");
    command.steps = static_cast<std::uint32_t>(steps.size());
    std::copy(steps.begin(), steps.end(), command.step.begin());
    tell(std::as_bytes(std::span(&command, 1)), at_most.count() == 0 ? Aim::dark : Aim::other);
}

void LampGuardian::darken(const std::vector<std::uint64_t>& steps) { drive(steps, Nanoseconds(0)); }

void LampGuardian::report() {
    const GuardianCommand command{.kind = GuardianCommand::Kind::report};
    tell(std::as_bytes(std::span(&command, 1)), Aim::other);
}

void LampGuardian::tell(Packet packet, Aim aim) {
    const std::scoped_lock lock(mutex_);
    if (!channel_) {
        if (aim == Aim::dark && taken_) return;
        take_over();
    }
    send(packet);
    const GuardianReply reply = receive();
    if (reply.failed != 0) throw DeviceError(reply.what.data(), reply.hint.data());
}

void LampGuardian::send(Packet packet) {
    constexpr int flags = MSG_NOSIGNAL | MSG_DONTWAIT;
    if (::send(channel_.get(), packet.data(), packet.size(), flags) == static_cast<ssize_t>(packet.size())) return;
    if (errno == EAGAIN) give_up();  // it has not heard a beat for as long as it takes to fill the channel
    take_over();
}

GuardianReply LampGuardian::receive() {
    // A reply that comes late would answer the next command.
    if (!await_packet(channel_, options_.reply_within)) give_up();
    GuardianReply reply;
    if (::recv(channel_.get(), &reply, sizeof reply, 0) != static_cast<ssize_t>(sizeof reply)) take_over();
    return reply;
}

/// A guardian that hangs: alive, it would keep the lines.
void LampGuardian::give_up() {
    if (pid_ > 0) ::kill(pid_, SIGKILL);
    take_over();
}

/// The kernel frees the lines of a dead guardian soon, not at once.
void LampGuardian::take_over() {
    channel_.reset();
    constexpr const char* what = "the lamps' guardian died or hung";
    for (int i = 0; !taken_; ++i) {
        try {
            taken_ = request_lines_(request_);
        } catch (const Error& error) {
            if (i + 1 >= tries)
                throw DeviceError(std::string(what) + ", and the lamps cannot be darkened: " + error.what(),
                                  "cut the lamps' supply; " + error.hint());
            std::this_thread::sleep_for(try_again_after);
        }
    }
    throw DeviceError(std::string(what) + "; the lamps are dark, and stay so until this program is started again",
                      "start it again");
}

void LampGuardian::beat(const std::stop_token& stop) {
    std::condition_variable_any wake;
    std::mutex mine;
    std::unique_lock lock(mine);
    while (!stop.stop_requested()) {
        wake.wait_for(lock, stop, options_.beat_every, [] { return false; });
        const std::scoped_lock channel_lock(mutex_);
        const GuardianCommand command{.kind = GuardianCommand::Kind::beat};
        // A failure is told by the next command, on the thread that can act on it.
        if (channel_) ::send(channel_.get(), &command, sizeof command, MSG_NOSIGNAL | MSG_DONTWAIT);
    }
}

}  // namespace darkbox
