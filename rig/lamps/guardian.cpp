#include "rig/lamps/guardian.h"

#include <fmt/format.h>
#include <sys/socket.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <limits>
#include <optional>
#include <thread>

#include "acquisition/device/device_error.h"

namespace darkbox {
namespace {

constexpr auto try_again = std::chrono::milliseconds(100);

using Packet = std::array<char, std::max(sizeof(GuardianCommand), sizeof(GuardianOpening))>;

template <typename T>
std::optional<T> packet_as(const Packet& packet, ssize_t size) {
    if (size != static_cast<ssize_t>(sizeof(T))) return std::nullopt;
    T read;
    std::memcpy(&read, packet.data(), sizeof read);
    return read;
}

bool is_command(const GuardianCommand& command) {
    return command.kind <= GuardianCommand::Kind::report && command.steps <= GuardianCommand::most_steps &&
           command.at_most_ns >= 0;
}

template <typename Work>
GuardianReply reply_of(Work work) {
    try {
        work();
        return {};
    } catch (const Error& error) {
        return guardian_refusal(error.what(), error.hint());
    } catch (const std::exception& error) {
        return guardian_refusal(error.what(), "");
    }
}

/// A daemon that does not read its replies is not waited for: time would pass, and a lamp burn on.
bool send_reply(int channel, const GuardianReply& reply) {
    constexpr int flags = MSG_NOSIGNAL | MSG_DONTWAIT;
    return ::send(channel, &reply, sizeof reply, flags) == static_cast<ssize_t>(sizeof reply);
}

}  // namespace

Guardian::~Guardian() {
    constexpr int last_tries = 100;
    darken();
    for (int i = 0; owed_ && i < last_tries; ++i) {
        std::this_thread::sleep_for(try_again);
        repay();
    }
}

bool Guardian::hear(int channel) {
    Packet packet;
    const ssize_t size = ::recv(channel, packet.data(), packet.size(), MSG_TRUNC | MSG_DONTWAIT);
    if (size < 0 && (errno == EINTR || errno == EAGAIN)) return true;
    if (const auto opening = packet_as<GuardianOpening>(packet, size)) {
        const auto request = request_in(*opening);
        if (!request) return false;
        heard_ = clock_.now();
        return send_reply(channel, reply_of([&] { open(*request); }));
    }
    const auto command = packet_as<GuardianCommand>(packet, size);
    if (!command || !is_command(*command)) return false;
    heard_ = clock_.now();
    return command->kind == GuardianCommand::Kind::beat || send_reply(channel, reply_of([&] { obey(*command); }));
}

/// Lines that are held already are not let go of, not even for the moment that requesting them anew would take.
void Guardian::open(const GpioRequest& request) {
    forced_.clear();
    darken();
    if (request != *request_) {
        lines_.reset();
        request_ = std::make_shared<const GpioRequest>(request);
    }
    if (lines_) return;
    lines_ = request_lines_(*request_);
    if (owed_ && *owed_ == *request_) owed_.reset();
}

void Guardian::repay() noexcept {
    if (!owed_) return;
    try {
        auto dark = request_lines_(*owed_);
        if (*owed_ == *request_) lines_ = std::move(dark);
        owed_.reset();
    } catch (...) {  // NOLINT(bugprone-empty-catch): it stays owed
    }
}

void Guardian::obey(const GuardianCommand& command) {
    if (command.kind == GuardianCommand::Kind::drive) return drive(command);
    need_lines();
    if (!forced_.empty()) refuse_forced();
}

void Guardian::need_lines() const {
    if (lines_) return;
    throw DeviceError(fmt::format("the lines of GPIO chip \"{}\" are not open", request_->chip),
                      "check the chip's cable, then darkbox lamps dark opens them again");
}

void Guardian::drive(const GuardianCommand& command) {
    constexpr Nanoseconds longest = std::chrono::hours(1);
    need_lines();
    const std::uint64_t last = command.steps == 0 || command.at_most_ns == 0 ? 0 : command.step.at(command.steps - 1);
    if (last == 0)
        forced_.clear();
    else if (!forced_.empty())
        refuse_forced();
    const TimePoint until = clock_.now() + std::min(Nanoseconds(command.at_most_ns), longest);
    // Lit again is lit on: the time that a lamp may burn is counted from when it was dark.
    lit_until_ = last != 0 && last == lit_ ? std::min(lit_until_, until) : until;
    lit_ = last == 0 ? lit_ : last;  // before the lines change: a failure must find it
    for (std::size_t i = 0; i < command.steps; ++i) set(command.step.at(i));
    if (last == 0) darken_or_throw();
}

void Guardian::set(std::uint64_t step) {
    try {
        std::vector<bool> active(request_->lines.size());
        for (std::size_t i = 0; i < active.size(); ++i) active[i] = ((step >> i) & 1U) != 0;
        lines_->set(active);
    } catch (...) {
        lines_.reset();  // opened anew, also after a replug, they start dark
        if (lit_ != 0) owed_ = request_;
        lit_ = 0;
        throw;
    }
}

void Guardian::darken_or_throw() {
    set(0);
    lit_ = 0;
}

void Guardian::darken() noexcept {
    try {
        if (lines_) darken_or_throw();
    } catch (...) {  // NOLINT(bugprone-empty-catch): set() has noted what is owed
    }
    repay();
}

TimePoint Guardian::overdue_at() const { return std::min(lit_until_, heard_ + silence_); }

int Guardian::milliseconds_left() const {
    const std::int64_t most = owed_ ? try_again.count() : std::numeric_limits<int>::max();
    if (lit_ == 0) return owed_ ? static_cast<int>(most) : -1;
    const auto left = std::chrono::ceil<std::chrono::milliseconds>(overdue_at() - clock_.now()).count();
    return static_cast<int>(std::clamp<std::int64_t>(left, 0, most));
}

void Guardian::darken_when_overdue() {
    repay();
    const TimePoint now = clock_.now();
    if (lit_ == 0 || now < overdue_at()) return;
    forced_ = now >= lit_until_ ? "a lamp was lit for longer than its max_on_s, and was darkened"
                                : "the program that drives the lamps fell silent, and they were darkened";
    darken();
}

void Guardian::refuse_forced() const {
    throw DeviceError(forced_, "darkbox lamps dark, then go on; raise max_on_s if the lamp bears it");
}

}  // namespace darkbox
