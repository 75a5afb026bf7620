// A chip that fails at the moment when a lamp must go dark.
#include <gmock/gmock.h>
#include <signal.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <cstddef>
#include <new>
#include <vector>

#include "rig/lamps/guardian.h"
#include "rig/lamps/guardian_process.h"
#include "tests/rig/lamps/recorded_lines.h"

namespace darkbox {
namespace {

using testing::ElementsAre;

constexpr Nanoseconds half_an_hour = std::chrono::minutes(30);

GpioRequest lines_of(std::size_t count) {
    GpioRequest request{.chip = "bench", .lines = {}};
    for (std::size_t i = 0; i < count; ++i) request.lines.push_back({std::to_string(i), false});
    return request;
}

/// Both ends of a daemon's talk with its guardian.
class Talk {
public:
    Talk() {
        std::array<int, 2> ends{};
        if (::socketpair(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0, ends.data()) != 0) throw std::bad_alloc();
        daemon.reset(ends[0]);
        guardian.reset(ends[1]);
    }

    void say_open(std::size_t lines) const { say(guardian_opening(lines_of(lines))); }
    void say_lit(std::uint64_t step) const {
        say(GuardianCommand{
            .kind = GuardianCommand::Kind::drive, .steps = 1, .step = {step}, .at_most_ns = half_an_hour.count()});
    }

    UniqueFd daemon;
    UniqueFd guardian;

private:
    template <typename T>
    void say(const T& packet) const {
        ASSERT_EQ(::send(daemon.get(), &packet, sizeof packet, 0), static_cast<ssize_t>(sizeof packet));
    }
};

class OwedDarkness : public testing::Test {
protected:
    RequestLines noted_request() {
        return [this, request = chip_.request()](const GpioRequest& lines) {
            requested_.push_back(lines.lines.size());
            return request(lines);
        };
    }
    void open(Guardian& guardian, std::size_t lines) const {
        talk_.say_open(lines);
        ASSERT_TRUE(guardian.hear(talk_.guardian.get()));
    }
    void light(Guardian& guardian, std::uint64_t step) {
        talk_.say_lit(step);
        ASSERT_TRUE(guardian.hear(talk_.guardian.get()));
        ASSERT_EQ(chip_.record().active, step);
    }
    void fail(int sets, int requests) {
        chip_.record().failing_sets = sets;
        chip_.record().failing_requests = requests;
    }

    test::RecordedChip chip_;
    Talk talk_;
    std::vector<std::size_t> requested_;  ///< how many lines, by every request
    const RequestLines request_lines_ = noted_request();
};

TEST_F(OwedDarkness, IsTriedForUntilTheChipWorks) {
    Guardian guardian(request_lines_, half_an_hour);
    open(guardian, 3);
    light(guardian, 4);
    fail(1, 2);
    guardian.darken();
    EXPECT_EQ(guardian.milliseconds_left(), 100);
    guardian.darken_when_overdue();
    EXPECT_EQ(guardian.milliseconds_left(), 100);
    EXPECT_EQ(chip_.record().active, 4u) << "as the chip left it";
    guardian.darken_when_overdue();
    EXPECT_EQ(chip_.record().active, 0u);
    EXPECT_TRUE(chip_.record().held);
    EXPECT_EQ(guardian.milliseconds_left(), -1);
    EXPECT_THAT(requested_, ElementsAre(3, 3, 3, 3));
    guardian.darken_when_overdue();
    EXPECT_EQ(requested_.size(), 4u);
}

TEST_F(OwedDarkness, IsNotOwedByALampThatWasDark) {
    Guardian guardian(request_lines_, half_an_hour);
    open(guardian, 3);
    fail(1, 0);
    guardian.darken();
    EXPECT_EQ(guardian.milliseconds_left(), -1);
    EXPECT_THAT(requested_, ElementsAre(3));
}

TEST_F(OwedDarkness, IsPaidByADaemonThatOpensTheSameLines) {
    Guardian guardian(request_lines_, half_an_hour);
    open(guardian, 3);
    light(guardian, 4);
    fail(1, 1);
    open(guardian, 3);
    EXPECT_EQ(chip_.record().active, 0u);
    EXPECT_EQ(guardian.milliseconds_left(), -1);
    EXPECT_THAT(requested_, ElementsAre(3, 3, 3));
}

TEST_F(OwedDarkness, ComesBeforeOtherLinesAreRequested) {
    Guardian guardian(request_lines_, half_an_hour);
    open(guardian, 3);
    light(guardian, 4);
    open(guardian, 2);
    EXPECT_THAT(chip_.record().all_sets(), ElementsAre(4, 0));
    EXPECT_THAT(requested_, ElementsAre(3, 2));
}

TEST_F(OwedDarkness, IsOfTheLinesThatWereLitWhateverIsHeldSince) {
    Guardian guardian(request_lines_, half_an_hour);
    open(guardian, 3);
    light(guardian, 4);
    fail(1, 1);
    open(guardian, 2);
    EXPECT_EQ(guardian.milliseconds_left(), 100);
    guardian.darken_when_overdue();
    EXPECT_EQ(guardian.milliseconds_left(), -1);
    EXPECT_THAT(requested_, ElementsAre(3, 3, 2, 3));
}

TEST_F(OwedDarkness, IsPaidByTheLastActOfAGuardian) {
    {
        Guardian guardian(request_lines_, half_an_hour);
        open(guardian, 3);
        light(guardian, 4);
    }
    EXPECT_THAT(chip_.record().all_sets(), ElementsAre(4, 0));
    {
        Guardian guardian(request_lines_, half_an_hour);
        open(guardian, 3);
        light(guardian, 2);
        fail(1, 3);
    }
    EXPECT_EQ(chip_.record().active, 0u);
    EXPECT_THAT(requested_, ElementsAre(3, 3, 3, 3, 3, 3));
}

/// What is no std::exception is not answered: it ends the guardian, as running out of memory may.
TEST_F(OwedDarkness, IsPaidByAForkedGuardianThatFails) {
    int calls = 0;
    const RequestLines fails_twice = [&, request = chip_.request()](const GpioRequest& lines) {
        ++calls;
        if (calls == 2 || calls == 3) throw calls;
        return request(lines);
    };
    const pid_t guardian = ::fork();
    if (guardian == 0) {
        talk_.daemon.reset();
        guard_lamps(std::move(talk_.guardian), fails_twice, half_an_hour);
    }
    talk_.say_open(3);
    talk_.say_lit(4);
    ASSERT_TRUE(test::comes_true([&] { return chip_.record().active == 4; }));
    fail(1, 0);
    talk_.say_open(2);
    EXPECT_TRUE(test::comes_true([&] { return chip_.record().active == 0; }));
    int status = 0;
    EXPECT_EQ(::waitpid(guardian, &status, 0), guardian);
    EXPECT_TRUE(WIFEXITED(status));
}

}  // namespace
}  // namespace darkbox
