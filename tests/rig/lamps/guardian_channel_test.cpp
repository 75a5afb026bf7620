// The daemon's end of the channel: signals that interrupt it, and a guardian that hears nothing.
#include <gtest/gtest.h>
#include <pthread.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <functional>
#include <stdexcept>
#include <thread>

#include "rig/lamps/lamp_guardian.h"
#include "tests/rig/lamps/recorded_lines.h"
#include "tests/support/packet_socket.h"
#include "tests/support/test_data.h"

namespace darkbox {
namespace {

constexpr Nanoseconds an_hour = std::chrono::hours(1);

GpioRequest one_line() { return {.chip = "bench", .lines = {{"0", false}}}; }

struct Ends {
    UniqueFd daemon;
    UniqueFd guardian;
};

Ends channel_as_connected() {
    std::array<int, 2> ends{};
    if (::socketpair(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC | SOCK_NONBLOCK, 0, ends.data()) != 0)
        throw std::runtime_error("no socket pair");
    return {UniqueFd(ends[0]), UniqueFd(ends[1])};
}

/// Interrupts the thread that made it, again and again, and then does this.
std::jthread after_interruptions(std::function<void()> then) {
    struct sigaction ignoring{};
    ignoring.sa_handler = [](int) {};
    ::sigaction(SIGUSR1, &ignoring, nullptr);
    return std::jthread([waiting = ::pthread_self(), then = std::move(then)] {
        for (int i = 0; i < 20; ++i) {
            std::this_thread::sleep_for(std::chrono::milliseconds(10));
            ::pthread_kill(waiting, SIGUSR1);
        }
        then();
    });
}

TEST(GuardianChannel, WaitsForTheGreetingThroughSignals) {
    const test::TemporaryFolder folder;
    const UniqueFd listening = test::listening_for_packets(folder.path() / "g");
    UniqueFd accepted;
    const std::jthread guardian = after_interruptions([&] {
        accepted.reset(::accept(listening.get(), nullptr, nullptr));
        const GuardianGreeting greeting{.process = 7};
        ::send(accepted.get(), &greeting, sizeof greeting, MSG_NOSIGNAL);
    });
    EXPECT_EQ(connect_guardian(folder.path() / "g", an_hour).value().process, 7);
}

TEST(GuardianChannel, WaitsForDarknessThroughSignals) {
    test::RecordedChip chip;
    Ends ends = channel_as_connected();
    std::atomic<bool> dark = false;
    const std::jthread guardian = after_interruptions([&] {
        dark = true;
        ends.guardian.reset();
    });
    {
        const LampGuardian daemon(one_line(), chip.request(), GuardianConnection{.channel = std::move(ends.daemon)},
                                  {.reply_within = an_hour});
    }
    EXPECT_TRUE(dark);
}

TEST(GuardianChannel, ThatIsFullIsOfAGuardianThatHangsAndIsKilled) {
    test::RecordedChip chip;
    Ends ends = channel_as_connected();
    const pid_t hung = ::fork();
    if (hung == 0)
        while (true) ::pause();
    const GuardianCommand beat{};
    while (::send(ends.daemon.get(), &beat, sizeof beat, MSG_NOSIGNAL) > 0) continue;
    ASSERT_EQ(errno, EAGAIN);
    LampGuardian daemon(one_line(), chip.request(),
                        GuardianConnection{.channel = std::move(ends.daemon), .process = hung});
    EXPECT_THROW(daemon.drive({1}, an_hour), DeviceError);
    EXPECT_TRUE(chip.record().held);
    int status = 0;
    EXPECT_TRUE(test::comes_true([&] { return ::waitpid(hung, &status, WNOHANG) == hung; }));
    EXPECT_TRUE(WIFSIGNALED(status));
    ::kill(hung, SIGKILL);
}

}  // namespace
}  // namespace darkbox
