// The guardian as a program of its own, on a socket: real processes over recorded lines.
#include <gmock/gmock.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstring>
#include <functional>
#include <vector>

#include "rig/lamps/guardian_process.h"
#include "rig/lamps/lamp_guardian.h"
#include "tests/rig/lamps/recorded_lines.h"
#include "tests/support/child_process.h"
#include "tests/support/packet_socket.h"
#include "tests/support/test_data.h"

namespace darkbox {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

constexpr Nanoseconds a_long_time = std::chrono::minutes(10);

GpioRequest three_lines() { return {.chip = "bench", .lines = {{"0", false}, {"1", true}, {"lamp", false}}}; }

/// A process of the test's own that does this and then lives on until it is killed.
class Process {
public:
    explicit Process(const std::function<void()>& work) : pid_(::fork()) {
        if (pid_ != 0) return;
        work();
        ::_exit(0);
    }
    Process(const Process&) = delete;
    Process& operator=(const Process&) = delete;
    ~Process() {
        signal(SIGKILL);
        wait();
    }
    pid_t id() const { return pid_; }
    void signal(int number) const {
        if (pid_ > 0) ::kill(pid_, number);
    }
    bool running() {
        if (pid_ > 0 && ::waitpid(pid_, &status_, WNOHANG) == pid_) pid_ = -1;
        return pid_ > 0;
    }
    /// The exit status, or 128 + N.
    int wait() {
        if (pid_ > 0) ::waitpid(pid_, &status_, 0);
        pid_ = -1;
        return WIFEXITED(status_) ? WEXITSTATUS(status_) : 128 + WTERMSIG(status_);
    }

private:
    pid_t pid_;
    int status_ = 0;
};

class GuardianProgram : public testing::Test {
protected:
    void SetUp() override {
        UniqueFd listening = test::listening_for_packets(socket_);
        guardian_.emplace([&] { serve_guardian(std::move(listening), chip_.request(), std::chrono::seconds(1)); });
    }

    LampGuardian daemon(GuardianOptions options = {}) {
        return {three_lines(), chip_.request(), connect_guardian(socket_).value(), options};
    }

    /// A daemon that has lit the last lamp, and does nothing but live.
    Process lit_daemon() {
        return Process([this] {
            LampGuardian guardian(three_lines(), chip_.request(), connect_guardian(socket_).value());
            guardian.open();
            guardian.drive({4}, a_long_time);
            while (true) ::pause();
        });
    }

    bool shows(std::uint64_t lines) {
        return test::comes_true([&] { return chip_.record().active == lines; });
    }
    bool is_held_by_the_guardian() {
        return chip_.record().held && chip_.record().holder == static_cast<std::uint32_t>(guardian_->id());
    }

    test::TemporaryFolder folder_;
    const fs::path socket_ = folder_.path() / "guardian.sock";
    test::RecordedChip chip_;
    std::optional<Process> guardian_;
};

TEST_F(GuardianProgram, DarkensAfterAKilledDaemonAndHoldsTheLinesForTheNext) {
    for (int life = 0; life < 5; ++life) {
        Process killed = lit_daemon();
        ASSERT_TRUE(shows(4));
        killed.signal(SIGKILL);
        killed.wait();
        EXPECT_TRUE(shows(0));
        EXPECT_TRUE(guardian_->running());
        EXPECT_TRUE(is_held_by_the_guardian());
    }
    LampGuardian next = daemon();
    next.open();
    next.drive({2}, a_long_time);
    EXPECT_EQ(chip_.record().active, 2u);
    EXPECT_EQ(chip_.record().requests, 1) << "the lines were let go of between two daemons";
}

TEST_F(GuardianProgram, RequestsOtherLinesForADaemonThatWantsOthers) {
    daemon().open();
    GpioRequest wider = three_lines();
    wider.lines.push_back({"more", false});
    LampGuardian other(wider, chip_.request(), connect_guardian(socket_).value());
    other.open();
    other.drive({8}, a_long_time);
    EXPECT_EQ(chip_.record().active, 8u);
    EXPECT_EQ(chip_.record().requests, 2);
}

TEST_F(GuardianProgram, IsDarkOnceItsDaemonHasLeft) {
    {
        LampGuardian guardian = daemon();
        EXPECT_EQ(guardian.process(), guardian_->id());
        guardian.open();
        guardian.drive({1}, a_long_time);
        EXPECT_EQ(chip_.record().active, 1u);
    }
    EXPECT_EQ(chip_.record().active, 0u);
    EXPECT_TRUE(is_held_by_the_guardian());
}

TEST_F(GuardianProgram, HearsOneDaemonAtATime) {
    const Process first = lit_daemon();
    ASSERT_TRUE(shows(4));
    try {
        connect_guardian(socket_);
        FAIL() << "two daemons";
    } catch (const DeviceError& error) {
        EXPECT_STREQ(error.what(), "another darkbox program drives the lamps");
    }
    EXPECT_EQ(chip_.record().active, 4u);
}

TEST_F(GuardianProgram, DarkensUnderAHungDaemonAndWaitsForItsEnd) {
    const Process hung = lit_daemon();
    ASSERT_TRUE(shows(4));
    hung.signal(SIGSTOP);
    EXPECT_TRUE(shows(0));
    EXPECT_TRUE(is_held_by_the_guardian());
    EXPECT_THROW(connect_guardian(socket_), DeviceError) << "it may wake up";
    hung.signal(SIGKILL);
    LampGuardian next = [&] {
        test::comes_true([&] {
            try {
                return connect_guardian(socket_).has_value();
            } catch (const DeviceError&) {
                return false;
            }
        });
        return daemon();
    }();
    next.open();
    next.drive({1}, a_long_time);
    EXPECT_EQ(chip_.record().active, 1u);
}

TEST_F(GuardianProgram, HearsTheNextDaemonHoweverMuchADeadOneSaid) {
    auto dead = connect_guardian(socket_);
    guardian_->signal(SIGSTOP);
    const GuardianCommand beat{};
    for (int i = 0; i < 50; ++i) ::send(dead->channel.get(), &beat, sizeof beat, MSG_NOSIGNAL);
    dead.reset();
    const UniqueFd next(::socket(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0));
    const sockaddr_un address = test::unix_address(socket_);
    ASSERT_EQ(::connect(next.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
    guardian_->signal(SIGCONT);
    GuardianGreeting greeting;
    ASSERT_EQ(::recv(next.get(), &greeting, sizeof greeting, 0), static_cast<ssize_t>(sizeof greeting));
    EXPECT_EQ(greeting.process, guardian_->id()) << greeting.reply.what.data();
}

TEST_F(GuardianProgram, HangsUpOnOtherUsersOfTheMachine) {
    if (::geteuid() != 0) GTEST_SKIP() << "only root can become another user";
    fs::permissions(folder_.path(), fs::perms::all);
    fs::permissions(socket_, fs::perms::all);
    Process stranger([this] {
        if (::setgid(65534) != 0 || ::setuid(65534) != 0) ::_exit(9);
        try {
            ::_exit(connect_guardian(socket_) ? 1 : 2);
        } catch (const DeviceError& error) {
            ::_exit(std::strstr(error.what(), "hung up") != nullptr ? 0 : 3);
        }
    });
    EXPECT_EQ(stranger.wait(), 0);
    fs::permissions(socket_, fs::perms::owner_read | fs::perms::owner_write);
    Process outside([this] {
        if (::setgid(65534) != 0 || ::setuid(65534) != 0) ::_exit(9);
        ::_exit(connect_guardian(socket_) ? 1 : 0);
    });
    EXPECT_EQ(outside.wait(), 0) << "for whom there is no guardian";
    EXPECT_TRUE(guardian_->running());
    daemon().open();
}

using Bytes = std::vector<char>;

template <typename T>
Bytes bytes_of(const T& packet) {
    const char* first = reinterpret_cast<const char*>(&packet);
    return {first, first + sizeof packet};
}

std::vector<Bytes> no_packets() {
    std::vector<Bytes> all{Bytes(1),
                           Bytes(sizeof(GuardianCommand) - 1),
                           Bytes(sizeof(GuardianCommand) + 1, 'x'),
                           Bytes(sizeof(GuardianOpening) - 1),
                           Bytes(sizeof(GuardianOpening) + 1),
                           Bytes(100'000, '\xff'),
                           Bytes(sizeof(GuardianCommand), '\xff'),
                           Bytes(sizeof(GuardianOpening), '\xff'),
                           Bytes(sizeof(GuardianOpening))};
    all.push_back(bytes_of(GuardianCommand{.kind = GuardianCommand::Kind::drive, .steps = 4, .at_most_ns = 1}));
    all.push_back(bytes_of(GuardianCommand{.kind = GuardianCommand::Kind::drive, .steps = 1, .at_most_ns = -1}));
    all.push_back(bytes_of(GuardianCommand{.kind = static_cast<GuardianCommand::Kind>(3)}));
    GuardianOpening opening = guardian_opening(three_lines());
    opening.lines = 4;  // the last has no name
    all.push_back(bytes_of(opening));
    opening.lines = 65;
    all.push_back(bytes_of(opening));
    opening = guardian_opening(three_lines());
    opening.line[1].name.fill('a');  // without an end
    all.push_back(bytes_of(opening));
    opening = guardian_opening(three_lines());
    opening.line[1].active_low = 2;
    all.push_back(bytes_of(opening));
    return all;
}

/// The kernel's word that the other end hung up, whatever it still said.
bool hangs_up(int channel) {
    return test::comes_true([&] {
        char byte = 0;
        const ssize_t size = ::recv(channel, &byte, 1, MSG_DONTWAIT);
        return size == 0 || (size < 0 && errno != EAGAIN);
    });
}

TEST_F(GuardianProgram, HangsUpInTheDarkOnWhatIsNoPacket) {
    const Bytes opening = bytes_of(guardian_opening(three_lines()));
    const Bytes light = bytes_of(GuardianCommand{
        .kind = GuardianCommand::Kind::drive, .steps = 1, .step = {4}, .at_most_ns = a_long_time.count()});
    for (const Bytes& damaged : no_packets()) {
        const auto talk = connect_guardian(socket_);
        ASSERT_TRUE(talk);
        for (const Bytes& good : {opening, light}) ::send(talk->channel.get(), good.data(), good.size(), 0);
        ASSERT_TRUE(shows(4));
        ::send(talk->channel.get(), damaged.data(), damaged.size(), MSG_NOSIGNAL);
        EXPECT_TRUE(hangs_up(talk->channel.get())) << damaged.size() << " bytes";
        EXPECT_EQ(chip_.record().active, 0u);
    }
    EXPECT_TRUE(guardian_->running());
    EXPECT_TRUE(is_held_by_the_guardian());
    LampGuardian next = daemon();
    next.open();
    next.drive({1}, a_long_time);
    EXPECT_EQ(chip_.record().active, 1u);
}

TEST_F(GuardianProgram, DoesNotWaitForADaemonThatReadsNoReplies) {
    const auto talk = connect_guardian(socket_);
    const GuardianOpening opening = guardian_opening(three_lines());
    EXPECT_TRUE(test::comes_true([&] {
        return ::send(talk->channel.get(), &opening, sizeof opening, MSG_NOSIGNAL) < 0 && errno != EAGAIN;
    })) << "it hangs up on it";
    EXPECT_NO_THROW(daemon().open());
}

TEST_F(GuardianProgram, IsNotEndedBeforeItsDaemon) {
    Process lit = lit_daemon();
    ASSERT_TRUE(shows(4));
    for (const int number : {SIGTERM, SIGINT, SIGHUP, SIGQUIT, SIGPIPE, SIGUSR1}) guardian_->signal(number);
    EXPECT_THROW(connect_guardian(socket_), DeviceError) << "it has seen the signals by now, and goes on";
    EXPECT_EQ(chip_.record().active, 4u);
    lit.signal(SIGKILL);
    EXPECT_TRUE(test::comes_true([&] { return !guardian_->running(); }));
    EXPECT_EQ(guardian_->wait(), 0);
    EXPECT_EQ(chip_.record().active, 0u);
    EXPECT_FALSE(chip_.record().held);
}

TEST_F(GuardianProgram, EndsBySigtermWhenNobodyNeedsIt) {
    daemon().open();
    guardian_->signal(SIGTERM);
    EXPECT_EQ(guardian_->wait(), 0);
    EXPECT_EQ(connect_guardian(socket_).has_value(), false);
}

TEST_F(GuardianProgram, ThatDiesOrHangsIsReplacedByDarkness) {
    for (const int number : {SIGKILL, SIGSTOP}) {
        if (!guardian_->running()) SetUp();
        LampGuardian guardian = daemon({.reply_within = std::chrono::milliseconds(500)});
        guardian.open();
        guardian.drive({1}, a_long_time);
        guardian_->signal(number);
        EXPECT_THROW(guardian.drive({2}, a_long_time), DeviceError);
        EXPECT_EQ(chip_.record().active, 0u);
        EXPECT_EQ(chip_.record().holder, static_cast<std::uint32_t>(::getpid()));
        EXPECT_EQ(guardian_->wait(), 128 + SIGKILL);
        fs::remove(socket_);
    }
}

TEST(GuardianSocket, IsNotThereOrTellsWhatIsWrong) {
    const test::TemporaryFolder folder;
    const fs::path socket = folder.path() / "g";
    EXPECT_FALSE(connect_guardian(socket));
    const UniqueFd listening = test::listening_for_packets(socket);
    const auto told = [&] {
        try {
            connect_guardian(socket, std::chrono::milliseconds(500));
        } catch (const DeviceError& error) {
            return std::string(error.what());
        }
        return std::string();
    };
    EXPECT_THAT(told(), HasSubstr("does not answer"));
    const Process other([&] {
        while (true) {
            const UniqueFd channel(::accept(listening.get(), nullptr, nullptr));
            const GuardianGreeting greeting{.version = GuardianGreeting::this_version + 1, .process = ::getpid()};
            ::send(channel.get(), &greeting, sizeof greeting, MSG_NOSIGNAL);
        }
    });
    EXPECT_THAT(told(), HasSubstr("another version"));
    EXPECT_THROW(connect_guardian(std::string(200, 'x')), InputError);
}

TEST(GuardianPackets, TellOfARequestWhatItIs) {
    EXPECT_EQ(request_in(guardian_opening(three_lines())), three_lines());
    const GpioRequest longest{.chip = std::string(63, 'c'),
                              .lines = std::vector(64, GpioLine{std::string(62, 'l'), true})};
    EXPECT_EQ(request_in(guardian_opening(longest)), longest);
    for (const GpioRequest& wrong :
         {GpioRequest{.chip = "", .lines = {{"0", false}}}, GpioRequest{.chip = std::string(64, 'c'), .lines = {}},
          GpioRequest{.chip = "c", .lines = {{std::string(63, 'l'), false}}},
          GpioRequest{.chip = "c", .lines = std::vector(65, GpioLine{"0", false})}})
        EXPECT_THROW(guardian_opening(wrong), InputError);
}

/// The program as it is installed, handed a socket as systemd hands it.
TEST(GuardianExecutable, ServesTheSocketItIsHanded) {
    const test::TemporaryFolder folder;
    const fs::path socket = folder.path() / "guardian.sock";
    const UniqueFd listening = test::listening_for_packets(socket);
    test::ChildProcess program(
        {"/bin/sh", "-c", "LISTEN_PID=$$ LISTEN_FDS=1 exec \"$@\"", "sh", DARKBOX_GUARDIAN_PROGRAM},
        folder.path() / "guardian", {listening.get()});
    {
        LampGuardian guardian({.chip = "no such chip", .lines = {{"0", false}}}, request_gpio_lines,
                              connect_guardian(socket, std::chrono::seconds(60)).value());
        try {
            guardian.open();
            FAIL() << "opened a chip that is not there";
        } catch (const DeviceError& error) {
            EXPECT_THAT(error.what(), HasSubstr("\"no such chip\""));
        }
    }
    program.signal(SIGTERM);
    EXPECT_EQ(program.wait(), 0) << program.err();
    EXPECT_EQ(program.err(), "");
}

TEST(GuardianExecutable, SaysWhoStartsItWithoutASocket) {
    const test::TemporaryFolder folder;
    test::ChildProcess program({DARKBOX_GUARDIAN_PROGRAM}, folder.path() / "guardian");
    EXPECT_EQ(program.wait(), 1);
    EXPECT_THAT(program.err(), HasSubstr("darkbox-guardian.socket"));
}

}  // namespace
}  // namespace darkbox
