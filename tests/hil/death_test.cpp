#include <gmock/gmock.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <fstream>
#include <functional>
#include <optional>
#include <sstream>

#include "acquisition/device/device_error.h"
#include "rig/lamps/guardian_socket.h"
#include "tests/hil/daemon.h"
#include "tests/hil/gpio_chip.h"
#include "tests/hil/kernel_trace.h"
#include "tests/hil/machine.h"
#include "tests/hil/rig_text.h"
#include "tests/hil/vivid.h"
#include "tests/support/child_process.h"
#include "tests/support/packet_socket.h"
#include "tests/support/test_data.h"

namespace darkbox {
namespace {

namespace fs = std::filesystem;
using test::TraceEvent;
using testing::HasSubstr;
using testing::IsEmpty;

const fs::path cgroups = "/sys/fs/cgroup";

/// A control group, as systemd makes one for each unit.
class ControlGroup {
public:
    explicit ControlGroup(const std::string& name) : folder_(cgroups / name) {
        test::put("+memory", cgroups / "cgroup.subtree_control");
        fs::create_directory(folder_);
    }
    ControlGroup(const ControlGroup&) = delete;
    ControlGroup& operator=(const ControlGroup&) = delete;
    ~ControlGroup() {
        test::comes_true([&] { return ::rmdir(folder_.c_str()) == 0; });
    }

    /// What runs a program as a member from its first moment.
    std::vector<std::string> enter() const {
        return {"/bin/sh", "-c", "echo $$ > " + (folder_ / "cgroup.procs").string() + "; exec \"$@\"", "sh"};
    }
    void take(int process) const { test::put(std::to_string(process), folder_ / "cgroup.procs"); }
    void kill() const { test::put("1", folder_ / "cgroup.kill"); }
    const fs::path& folder() const { return folder_; }

private:
    fs::path folder_;
};

/// darkboxd in the middle of a capture, with a lamp lit. Its camera is black, so every lamp burns through all its
/// tries.
class Death : public testing::Test {
protected:
    void SetUp() override {
        DARKBOX_NEED_MACHINE();
        vivid.emplace();
        vivid->set(test::Vivid::test_pattern, test::Vivid::black);
        chip.emplace("lamps");
        rig = folder.path() / "rig.toml";
        std::ofstream(rig) << test::rig_toml(
            {.device = vivid->webcam(),
             .camera = "format = \"GREY\"\nwidth = 320\nheight = 180\nframe_rate = 4\n",
             .extra = "[capture]\nmax_dark = 0.2\ntries = 20\n"});
    }

    void light(const std::vector<std::string>& through = {}) {
        daemon.emplace(folder.path(), rig, through);
        if (!program) guardian = daemon->guardian();
        trace.emplace(std::vector<std::string>{"gpio/gpio_value", "sched/sched_process_exit"});
        daemon->start_capture("nothing", {"lamp-05"});
        ASSERT_TRUE(test::comes_true([&] { return chip->is_high(4); })) << daemon->log();
    }

    bool is_dark() const {
        return test::comes_true([&] { return chip->high_lines().empty(); });
    }
    bool lives(int process) const { return fs::exists("/proc/" + std::to_string(process)); }

    /// By the kernel's own account: the daemon ended, then its guardian drove the line low, and nothing lit a line
    /// again. Returns how many events had passed by then.
    int expect_darkened_after_its_death() {
        const std::vector<TraceEvent> events = trace->events();
        const std::string line = std::to_string(chip->first_number() + 4);
        const int daemon_ends =
            last_of(events, [](const TraceEvent& e) { return e.name == "sched_process_exit" && e.task == "darkboxd"; });
        const int lit =
            last_of(events, [&](const TraceEvent& e) { return e.name == "gpio_value" && e.text == line + " set 1"; });
        const int darkened = last_of(events, [&](const TraceEvent& e) {
            return e.name == "gpio_value" && e.process == guardian && e.text == line + " set 0";
        });
        EXPECT_GT(lit, 0);
        EXPECT_LT(lit, daemon_ends);
        EXPECT_LT(daemon_ends, darkened);
        EXPECT_THAT(chip->high_lines(), IsEmpty());
        return darkened;
    }

    /// And then the guardian ended.
    void expect_order() {
        ASSERT_TRUE(test::comes_true([&] { return !lives(guardian); })) << "the guardian does not end";
        const int darkened = expect_darkened_after_its_death();
        EXPECT_LT(darkened, last_of(trace->events(), [&](const TraceEvent& e) {
                      return e.name == "sched_process_exit" && e.process == guardian;
                  }));
    }

    /// Its place among the events, from 1; -1: there is none.
    static int last_of(const std::vector<TraceEvent>& events, const std::function<bool(const TraceEvent&)>& fits) {
        const auto found = std::find_if(events.rbegin(), events.rend(), fits);
        return found == events.rend() ? -1 : static_cast<int>(events.rend() - found);
    }

    test::TemporaryFolder folder;
    std::optional<test::Vivid> vivid;
    std::optional<test::GpioChip> chip;
    fs::path rig;
    std::optional<test::Daemon> daemon;
    std::optional<test::ChildProcess> program;  // of the guardian, where it is not the daemon's child
    int guardian = 0;
    std::optional<test::KernelTrace> trace;
};

TEST_F(Death, BySigkill) {
    light();
    daemon->signal(SIGKILL);
    EXPECT_TRUE(is_dark());
    expect_order();
}

TEST_F(Death, BySigkillOfItsProcessGroup) {
    light({"/usr/bin/setsid"});
    ASSERT_EQ(::getpgid(daemon->process()), daemon->process());
    ::kill(-daemon->process(), SIGKILL);
    EXPECT_TRUE(is_dark());
    expect_order();
}

/// Its child, moved out of the group.
TEST_F(Death, BySigkillOfItsControlGroupWithTheGuardianInAnother) {
    const ControlGroup unit("darkboxd"), other("guardian");
    light(unit.enter());
    other.take(guardian);
    unit.kill();
    EXPECT_TRUE(is_dark());
    expect_order();
}

/// Where both are in one unit, as without darkbox-guardian.socket, nobody is left to darken anything: the kernel
/// releases the lines, and what pulls them decides. gpio-sim pulls low, as the resistors do that docs/gpio-lamps.md
/// asks for.
TEST_F(Death, BySigkillOfTheirCommonControlGroupLeavesTheLinesToTheirResistors) {
    const ControlGroup unit("darkboxd");
    light(unit.enter());
    chip->pull_up(9);
    unit.kill();
    EXPECT_TRUE(test::comes_true([&] { return !lives(guardian) && !chip->is_high(4); }));
    EXPECT_THAT(chip->high_lines(), testing::ElementsAre(9));
    std::string last;
    const std::string line = std::to_string(chip->first_number() + 4);
    for (const TraceEvent& event : trace->events())
        if (event.name == "gpio_value" && event.text.starts_with(line + " set")) last = event.text;
    EXPECT_EQ(last, line + " set 1") << "somebody darkened it: is the guardian in a unit of its own by now?";
}

/// The limit falls below what the daemon holds, as when it grew beyond MemoryMax= of its unit. The guardian is a
/// member, too, and may not be the victim.
TEST_F(Death, ByTheOomKiller) {
    const ControlGroup unit("darkboxd");
    light(unit.enter());
    std::istringstream stat(test::text_of(unit.folder() / "memory.stat"));
    std::string name;
    long anonymous = 0;
    stat >> name >> anonymous;
    ASSERT_EQ(name, "anon");
    test::put(std::to_string(anonymous / 2), unit.folder() / "memory.max");
    EXPECT_TRUE(is_dark());
    expect_order();
    EXPECT_THAT(test::text_of(unit.folder() / "memory.events"), HasSubstr("oom_kill 1"));
    EXPECT_EQ(daemon->wait(), 128 + SIGKILL);
}

/// darkboxd and darkbox-guardian as systemd has them: each in the control group of its unit, the guardian handed the
/// socket on which darkboxd finds it.
class DeathBesideTheGuardiansUnit : public Death {
protected:
    void SetUp() override {
        Death::SetUp();
        if (IsSkipped()) return;
        daemon_unit.emplace("darkboxd");
        guardian_unit.emplace("darkbox-guardian");
        const UniqueFd listening = test::listening_for_packets(socket);
        std::vector<std::string> command = guardian_unit->enter();
        for (const std::string& word :
             {std::string("/bin/sh"), std::string("-c"), std::string("LISTEN_PID=$$ LISTEN_FDS=1 exec \"$@\""),
              std::string("sh"), test::program("darkbox-guardian")})
            command.push_back(word);
        program.emplace(command, folder.path() / "guardian", std::vector{listening.get()});
        const auto runs = [] { return test::processes("darkbox-guard").size() == 1; };
        ASSERT_TRUE(test::comes_true(runs, test::start_of_a_program)) << program->err();
        guardian = test::processes("darkbox-guard").front();
    }

    void light_in_its_unit() {
        std::vector<std::string> through = daemon_unit->enter();
        through.insert(through.end(), {"/usr/bin/env", "DARKBOX_GUARDIAN=" + socket.string()});
        light(through);
    }

    const fs::path socket = folder.path() / "guardian.sock";
    std::optional<ControlGroup> daemon_unit, guardian_unit;
};

TEST_F(DeathBesideTheGuardiansUnit, BySigkillOfAllOfDarkboxd) {
    light_in_its_unit();
    daemon_unit->kill();
    EXPECT_TRUE(is_dark());
    expect_darkened_after_its_death();
    EXPECT_TRUE(lives(guardian));
    EXPECT_THAT(test::shell("gpioinfo lamps").text, HasSubstr("\"darkbox\"")) << "dark, but nobody holds it so";
    EXPECT_EQ(test::text_of(fs::path("/proc") / std::to_string(guardian) / "oom_score_adj"), "-1000\n");

    daemon.reset();
    trace.reset();
    fs::remove_all(folder.path() / "sessions");  // else it goes on with what was interrupted
    light_in_its_unit();
    daemon_unit->kill();
    EXPECT_TRUE(is_dark());
    expect_darkened_after_its_death();
    EXPECT_TRUE(lives(guardian));
}

TEST_F(DeathBesideTheGuardiansUnit, AfterSigtermOfTheGuardianWhichStaysAsLongAsItIsNeeded) {
    light_in_its_unit();
    program->signal(SIGTERM);
    EXPECT_THROW(connect_guardian(socket, test::start_of_a_program), DeviceError)
        << "it has seen the signal, and serves on";
    EXPECT_TRUE(chip->is_high(4));
    daemon_unit->kill();
    EXPECT_TRUE(is_dark());
    EXPECT_EQ(program->wait(), 0) << program->err();
    expect_order();
}

TEST_F(Death, ByHangingDarkensAndTheGuardianGoesOnHolding) {
    light();
    daemon->signal(SIGSTOP);
    EXPECT_TRUE(is_dark());
    EXPECT_TRUE(lives(guardian));
    EXPECT_THAT(test::shell("gpioinfo lamps").text, HasSubstr("\"darkbox\""));
    daemon->signal(SIGKILL);
    daemon->wait();
    EXPECT_TRUE(test::comes_true([&] { return !lives(guardian); }));
    EXPECT_THAT(chip->high_lines(), IsEmpty());
}

TEST_F(Death, BySigtermIsAnOrderlyEnd) {
    light();
    daemon->signal(SIGTERM);
    EXPECT_EQ(daemon->wait(), 0) << daemon->log();
    EXPECT_THAT(daemon->log(), HasSubstr("stopped, lamps dark"));
    EXPECT_THAT(chip->high_lines(), IsEmpty());
}

}  // namespace
}  // namespace darkbox
