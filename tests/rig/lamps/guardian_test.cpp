#include <gmock/gmock.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <functional>
#include <stdexcept>

#include "rig/lamps/lamp_guardian.h"
#include "tests/rig/lamps/recorded_lines.h"

namespace darkbox {
namespace {

using testing::HasSubstr;

GpioRequest nine_lines() {
    GpioRequest request{.chip = "bench", .lines = {}};
    for (int i = 0; i < 9; ++i) request.lines.push_back({std::to_string(i), false});
    return request;
}

constexpr Nanoseconds for_long = std::chrono::minutes(10);

bool alive(pid_t process) { return ::kill(process, 0) == 0; }

/// A process that lights a lamp through a guardian of its own and then does nothing but live. Dies with the test.
class LitDaemon {
public:
    explicit LitDaemon(
        test::RecordedChip& chip, const std::function<void(LampGuardian&)>& then = [](auto&) {})
        : record_(chip.record()) {
        pid_ = ::fork();
        if (pid_ != 0) return;
        {
            LampGuardian guardian(nine_lines(), chip.request());
            guardian.open();
            guardian.drive({1U << 4}, for_long);
            then(guardian);
            while (true) ::pause();
        }
    }
    LitDaemon(const LitDaemon&) = delete;
    LitDaemon& operator=(const LitDaemon&) = delete;
    ~LitDaemon() { kill_and_wait(); }

    bool lit() const {
        return test::comes_true([&] { return record_.active == 1U << 4; });
    }
    pid_t guardian() const { return static_cast<pid_t>(record_.holder.load()); }
    void signal(int number) const { ::kill(pid_, number); }
    void kill_and_wait() {
        if (pid_ <= 0) return;
        ::kill(pid_, SIGKILL);
        ::waitpid(pid_, nullptr, 0);
        pid_ = -1;
    }

private:
    test::LineRecord& record_;
    pid_t pid_;
};

TEST(Guardian, DarkensAndEndsWhenTheDaemonIsKilled) {
    for (int i = 0; i < 10; ++i) {
        test::RecordedChip chip;
        LitDaemon daemon(chip);
        ASSERT_TRUE(daemon.lit());
        const pid_t guardian = daemon.guardian();
        daemon.kill_and_wait();
        EXPECT_TRUE(test::comes_true([&] { return chip.record().active == 0; }));
        EXPECT_TRUE(test::comes_true([&] { return !chip.record().held || !alive(guardian); }));
    }
}

TEST(Guardian, DarkensWhenTheDaemonHangsAndGoesOnHolding) {
    test::RecordedChip chip;
    LitDaemon daemon(chip);
    ASSERT_TRUE(daemon.lit());
    daemon.signal(SIGSTOP);
    EXPECT_TRUE(test::comes_true([&] { return chip.record().active == 0; }));
    EXPECT_TRUE(chip.record().held);
    daemon.signal(SIGCONT);
}

TEST(Guardian, LightsNothingForADaemonThatWasHungUntilItDarkens) {
    test::RecordedChip chip;
    std::array<int, 2> go{};
    ASSERT_EQ(::pipe(go.data()), 0);
    LitDaemon daemon(chip, [&](LampGuardian& guardian) {
        char byte = 0;
        if (::read(go[0], &byte, 1) != 1) ::_exit(2);
        try {
            guardian.drive({2}, for_long);
        } catch (const DeviceError& error) {
            if (std::string(error.what()).find("fell silent") == std::string::npos) ::_exit(3);
            guardian.darken();
            guardian.drive({8}, for_long);
        }
    });
    ASSERT_TRUE(daemon.lit());
    daemon.signal(SIGSTOP);
    ASSERT_TRUE(test::comes_true([&] { return chip.record().active == 0; }));
    daemon.signal(SIGCONT);
    ASSERT_EQ(::write(go[1], "!", 1), 1);
    EXPECT_TRUE(test::comes_true([&] { return chip.record().active == 8; }));
    EXPECT_FALSE(chip.record().was_ever(2));
    ::close(go[0]);
    ::close(go[1]);
}

TEST(Guardian, IsNotEndedByTheSignalsThatEndADaemon) {
    test::RecordedChip chip;
    LitDaemon daemon(chip);
    ASSERT_TRUE(daemon.lit());
    for (const int number : {SIGTERM, SIGINT, SIGHUP, SIGQUIT, SIGPIPE}) ::kill(daemon.guardian(), number);
    EXPECT_TRUE(alive(daemon.guardian()));
    daemon.kill_and_wait();
    EXPECT_TRUE(test::comes_true([&] { return chip.record().active == 0; }));
    EXPECT_TRUE(chip.record().sets > 1) << "by a command, not by luck";
}

TEST(Guardian, IsNotFooledByAChildThatOutlivesTheDaemon) {
    test::RecordedChip chip;
    std::array<int, 2> stay{};
    ASSERT_EQ(::pipe(stay.data()), 0);
    LitDaemon daemon(chip, [&](LampGuardian&) {
        if (::fork() != 0) return;
        ::dup2(stay[0], STDIN_FILENO);
        ::close(stay[1]);
        ::execl("/bin/cat", "cat", nullptr);
        ::_exit(1);
    });
    ASSERT_TRUE(daemon.lit());
    std::this_thread::sleep_for(std::chrono::milliseconds(100));  // the child runs its own program by then
    daemon.kill_and_wait();
    EXPECT_TRUE(test::comes_true([&] { return chip.record().active == 0; }));
    ::close(stay[0]);
    ::close(stay[1]);
}

TEST(Guardian, KeepsNothingOpenThatItsParentHad) {
    std::array<int, 2> ends{};
    ASSERT_EQ(::pipe(ends.data()), 0);
    test::RecordedChip chip;
    LampGuardian guardian(nine_lines(), chip.request());
    guardian.open();
    ::close(ends[1]);
    char byte = 0;
    EXPECT_EQ(::read(ends[0], &byte, 1), 0) << "the guardian holds the pipe's other end";
    ::close(ends[0]);
}

TEST(Guardian, IsGoneAndTheLampsDarkOnceItsOwnerIsDestroyed) {
    test::RecordedChip chip;
    pid_t process = -1;
    {
        LampGuardian guardian(nine_lines(), chip.request());
        process = guardian.process();
        guardian.open();
        guardian.drive({1}, for_long);
        EXPECT_EQ(chip.record().active, 1u);
    }
    EXPECT_EQ(chip.record().active, 0u);
    EXPECT_FALSE(alive(process));
}

TEST(Guardian, ThatDiesIsReplacedByDarkness) {
    test::RecordedChip chip;
    LampGuardian guardian(nine_lines(), chip.request());
    guardian.open();
    guardian.drive({1}, for_long);
    ::kill(guardian.process(), SIGKILL);
    ::waitpid(guardian.process(), nullptr, 0);
    EXPECT_EQ(chip.record().active, 1u) << "a chip that keeps its values";
    EXPECT_THROW(guardian.drive({2}, for_long), DeviceError);
    EXPECT_EQ(chip.record().active, 0u);
    EXPECT_EQ(chip.record().holder, static_cast<std::uint32_t>(::getpid()));
    EXPECT_NO_THROW(guardian.darken());
    EXPECT_THROW(guardian.drive({2}, for_long), DeviceError);
    EXPECT_FALSE(chip.record().was_ever(2));
}

TEST(Guardian, ThatHangsIsReplacedByDarkness) {
    test::RecordedChip chip;
    LampGuardian guardian(nine_lines(), chip.request(), {.reply_within = std::chrono::milliseconds(500)});
    guardian.open();
    guardian.drive({1}, for_long);
    ::kill(guardian.process(), SIGSTOP);
    EXPECT_THROW(guardian.drive({2}, for_long), DeviceError);
    EXPECT_EQ(chip.record().active, 0u);
    EXPECT_FALSE(chip.record().was_ever(2));
}

}  // namespace
}  // namespace darkbox
