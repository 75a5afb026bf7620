// The promise that nothing captured is lost: `darkbox capture --standalone` is killed again and again.
#include <gtest/gtest.h>

#include <chrono>
#include <csignal>
#include <fstream>
#include <random>
#include <thread>

#include "acquisition/session/bag.h"
#include "tests/rig/cli/captured_frames.h"
#include "tests/support/child_process.h"
#include "tests/support/test_data.h"

namespace darkbox {
namespace {

namespace fs = std::filesystem;
using namespace test;

constexpr int lamps = 6;
constexpr std::size_t shots = lamps + 2;
constexpr int tries = 20;

class KillTest : public testing::Test {
protected:
    KillTest() { std::ofstream(rig_) << small_rig(lamps); }

    std::vector<std::string> capture(const fs::path& session) const {
        return {DARKBOX_PROGRAM, "capture", "--standalone", "--rig", rig_, "--out", session};
    }
    static std::vector<std::string> resume(const fs::path& session) {
        return {DARKBOX_PROGRAM, "capture", "--standalone", "--resume", session, "--json"};
    }
    /// Kills the command some random moment after it has this many frames on disk. Whether it was still at work.
    bool run_and_kill(const std::vector<std::string>& command, const fs::path& session, std::size_t frames) {
        ChildProcess process(command, folder_.path() / "killed");
        while (process.running() && frames_on_disk(session) < frames)
            std::this_thread::sleep_for(std::chrono::microseconds(200));
        std::this_thread::sleep_for(std::chrono::microseconds(random_() % 5000));
        process.signal(SIGKILL);
        return process.wait() == 128 + SIGKILL;
    }
    /// A kill between the seal and the journal's removal leaves both: then nothing is left to resume.
    static bool is_interrupted(const fs::path& session) {
        return fs::exists(session / "journal.jsonl") && !is_sealed(session);
    }
    int run(const std::vector<std::string>& command) {
        ChildProcess process(command, log_);
        const int status = process.wait();
        EXPECT_EQ(status, 0) << process.err();
        return status;
    }

    TemporaryFolder folder_;
    const fs::path rig_ = folder_.path() / "rig.toml";
    const fs::path log_ = folder_.path() / "run";
    std::mt19937 random_{20261123};
};

TEST_F(KillTest, EverySessionResumesAndSealsWithEveryFrameRight) {
    const fs::path reference_folder = folder_.path() / "reference";
    ASSERT_EQ(run(capture(reference_folder)), 0);
    const Session reference = Session::open(reference_folder);
    ASSERT_EQ(reference.frames().size(), shots);
    // The comparison must be able to fail: another lamp's frame is far away.
    ASSERT_GT(difference_in_noise(reference, reference.frames()[1], reference, reference.frames()[2]), 5.0);

    int killed_at_work = 0;
    for (int i = 0; i < tries; ++i) {
        SCOPED_TRACE(i);
        const fs::path session = folder_.path() / ("session-" + std::to_string(i));
        const bool killed = run_and_kill(capture(session), session, random_() % shots);
        killed_at_work += killed ? 1 : 0;
        if (!fs::exists(session / "journal.jsonl") && !fs::exists(session / "bagit.txt")) {
            // Killed before the session began: nothing was acknowledged, and the same command starts anew.
            ASSERT_EQ(frames_on_disk(session), 0u);
            ASSERT_EQ(run(capture(session)), 0);
        } else if (is_interrupted(session)) {
            // Every second one is killed a second time, while it resumes.
            if (i % 2 == 1) run_and_kill(resume(session), session, random_() % shots);
            if (is_interrupted(session)) {
                ASSERT_EQ(run(resume(session)), 0);
            }
        }
        expect_same_light(Session::open(session), reference);
    }
    EXPECT_GE(killed_at_work, tries / 2);
}

TEST_F(KillTest, AnInterruptLeavesASessionThatResumes) {
    const fs::path session = folder_.path() / "session";
    ChildProcess process(capture(session), folder_.path() / "interrupted");
    while (process.running() && frames_on_disk(session) < 1)
        std::this_thread::sleep_for(std::chrono::microseconds(200));
    process.signal(SIGINT);
    const int status = process.wait();
    if (status == 0) GTEST_SKIP() << "the capture was done before the signal came";
    EXPECT_EQ(status, 1);
    EXPECT_NE(process.err().find("--resume " + session.string()), std::string::npos) << process.err();
    ASSERT_EQ(run(resume(session)), 0);
    EXPECT_NO_THROW(Session::open(session).verify());
}

}  // namespace
}  // namespace darkbox
