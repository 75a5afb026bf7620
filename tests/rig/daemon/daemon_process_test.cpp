// darkboxd and darkbox as the processes that people run, on the simulated rig.
#include <gmock/gmock.h>

#include <chrono>
#include <csignal>
#include <fstream>
#include <thread>

#include "rig/daemon/client.h"
#include "tests/rig/cli/captured_frames.h"
#include "tests/support/child_process.h"
#include "tests/support/test_data.h"

namespace darkbox {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using testing::HasSubstr;
using namespace test;

class DaemonProcess : public testing::Test {
protected:
    DaemonProcess() { std::ofstream(rig_) << small_rig(6); }

    void start() {
        daemon_.emplace(
            std::vector<std::string>{DARKBOXD_PROGRAM, "--config", rig_, "--socket", socket_, "--sessions", sessions_},
            folder_.path() / "daemon");
        while (daemon_->running() && !is_idle()) std::this_thread::sleep_for(std::chrono::milliseconds(5));
        ASSERT_TRUE(daemon_->running()) << daemon_->err();
    }
    bool is_idle() const { return client_.answers() && client_.call("GET", "status").at("state") == "Idle"; }

    struct Ended {
        int status;
        std::string out;
        std::string err;
    };
    Ended darkbox(std::vector<std::string> arguments) const {
        arguments.insert(arguments.begin(), DARKBOX_PROGRAM);
        arguments.insert(arguments.end(), {"--socket", socket_});
        ChildProcess process(arguments, folder_.path() / "command");
        const int status = process.wait();
        return {status, process.out(), process.err()};
    }

    TemporaryFolder folder_;
    const fs::path rig_ = folder_.path() / "rig.toml";
    const fs::path socket_ = folder_.path() / "d.sock";
    const fs::path sessions_ = folder_.path() / "sessions";
    const DaemonClient client_{socket_};
    std::optional<ChildProcess> daemon_;
};

TEST_F(DaemonProcess, CapturesForTheCommandLine) {
    start();
    const Ended ended = darkbox({"capture", "--object", "a cat", "--out", "cat", "--json"});
    ASSERT_EQ(ended.status, 0) << ended.err;
    const json result = json::parse(ended.out);
    EXPECT_EQ(result.at("frames"), 8);
    EXPECT_EQ(result.at("resumed"), 0);
    EXPECT_GT(result.at("seconds"), 0.0);
    EXPECT_EQ(result.at("session"), (sessions_ / "cat").string());
    const Session session = Session::open(sessions_ / "cat");
    EXPECT_NO_THROW(session.verify());
    EXPECT_EQ(session.info().object, "a cat");
    EXPECT_TRUE(fs::exists(sessions_ / "cat" / "truth" / "lamps.json"));

    const json listed = json::parse(darkbox({"sessions", "--json"}).out).at("sessions");
    ASSERT_EQ(listed.size(), 1u);
    EXPECT_EQ(listed[0].at("state"), "sealed");
    EXPECT_EQ(listed[0].at("frames"), 8);
    EXPECT_EQ(json::parse(darkbox({"rig", "status", "--json"}).out).at("state"), "Idle");
    EXPECT_EQ(json::parse(darkbox({"lamps", "list", "--json"}).out).at("lamps").size(), 6u);
    EXPECT_EQ(json::parse(darkbox({"lamps", "dark", "--json"}).out).at("dark"), true);

    // The same name again is refused, in words and with status 1.
    const Ended again = darkbox({"capture", "--out", "cat"});
    EXPECT_EQ(again.status, 1);
    EXPECT_THAT(again.err, HasSubstr("already"));
}

TEST_F(DaemonProcess, NamesLampsThatAreExchanged) {
    std::string toml = small_rig(6);
    toml.replace(toml.find("[sim]\n"), 6, "[sim]\nfaults = \"swapped-lamps@0:1,4\"\n");
    std::ofstream(rig_) << toml;
    start();
    const Ended ended = darkbox({"capture", "--out", "cat", "--json"});
    ASSERT_EQ(ended.status, 0) << ended.err;
    const json findings = json::parse(ended.out).at("findings");
    ASSERT_EQ(findings.size(), 1U);
    EXPECT_THAT(findings[0].get<std::string>(), HasSubstr("lamp-02 and lamp-05 are exchanged"));
    EXPECT_EQ(client_.call("GET", "jobs/1").at("findings"), findings);
    EXPECT_EQ(Session::open(sessions_ / "cat").events().back().what, findings[0].get<std::string>());
}

TEST_F(DaemonProcess, LightsALampByHandAndBooksItsLight) {
    std::string toml = small_rig(6);
    const std::string place = "position_mm";
    for (auto at = toml.find(place); at != toml.npos; at = toml.find(place, at + 40))
        toml.insert(at, "illuminance_lux = 1000\n");
    std::ofstream(rig_) << toml << "\n[dose]\nobject_lux_s = 2000\n";
    start();
    const auto dose_of = [&](const std::string& whose) {
        const json dose = client_.call("GET", "dose");
        for (const json& object : dose.at("objects"))
            if (object.at("object") == whose) return object.at("lux_s").get<double>();
        return 0.0;
    };
    const Ended lit = darkbox({"lamps", "on", "lamp-03", "--seconds", "1.5", "--object", "vase", "--json"});
    ASSERT_EQ(lit.status, 0) << lit.err;
    EXPECT_EQ(json::parse(lit.out).at("dark"), true);
    EXPECT_NEAR(dose_of("vase"), 1500, 5);
    const Ended refused = darkbox({"lamps", "on", "lamp-03", "--seconds", "1.5", "--object", "vase"});
    EXPECT_EQ(refused.status, 1);
    EXPECT_THAT(refused.err, HasSubstr("'vase' has had 1500 of 2000 lux seconds"));
    EXPECT_NEAR(dose_of("vase"), 1500, 5);
    ASSERT_EQ(darkbox({"lamps", "on", "lamp-03", "--seconds", "1.6"}).status, 0);
    ASSERT_EQ(darkbox({"lamps", "on", "lamp-04", "--seconds", "1.6"}).status, 0) << "the rig has no budget";
    EXPECT_NEAR(dose_of("rig simulated-6"), 3200, 5);
    EXPECT_THAT(darkbox({"lamps", "on", "lamp-09"}).err, HasSubstr("there is no lamp 'lamp-09'"));
    EXPECT_TRUE(is_idle());
}

TEST_F(DaemonProcess, SigtermDuringACaptureLeavesItResumable) {
    start();
    client_.call("POST", "captures", {{"name", "vase"}});
    while (daemon_->running() && frames_on_disk(sessions_ / "vase") < 2)
        std::this_thread::sleep_for(std::chrono::microseconds(200));
    daemon_->signal(SIGTERM);
    EXPECT_EQ(daemon_->wait(), 0) << daemon_->err();
    EXPECT_THAT(daemon_->err(), HasSubstr("lamps dark"));
    EXPECT_FALSE(fs::exists(socket_));
    if (!fs::exists(sessions_ / "vase" / "journal.jsonl")) GTEST_SKIP() << "the capture was done before the signal";

    start();
    const Ended resumed = darkbox({"capture", "--resume", "vase", "--json"});
    ASSERT_EQ(resumed.status, 0) << resumed.err;
    EXPECT_GE(json::parse(resumed.out).at("resumed"), 1);
    EXPECT_NO_THROW(Session::open(sessions_ / "vase").verify());
}

TEST_F(DaemonProcess, SaysHowToBeStartedWhereItIsNot) {
    const Ended ended = darkbox({"capture"});
    EXPECT_EQ(ended.status, 1);
    EXPECT_THAT(ended.err, HasSubstr("no darkboxd answers"));
    EXPECT_THAT(ended.err, HasSubstr("--standalone"));
}

TEST_F(DaemonProcess, RefusesASocketThatAnotherHolds) {
    start();
    ChildProcess second({DARKBOXD_PROGRAM, "--config", rig_, "--socket", socket_, "--sessions", sessions_},
                        folder_.path() / "second");
    EXPECT_EQ(second.wait(), 1);
    EXPECT_THAT(second.err(), HasSubstr("another darkboxd"));
    EXPECT_TRUE(client_.answers());
}

TEST_F(DaemonProcess, ReplacesOneThatWasKilled) {
    start();
    daemon_->signal(SIGKILL);
    daemon_->wait();
    EXPECT_TRUE(fs::exists(socket_));
    start();
    EXPECT_TRUE(is_idle());
}

}  // namespace
}  // namespace darkbox
