// A whole session over USB: darkboxd and Debian's libusb drive the image that is flashed, emulated behind umockdev; the
// twin's camera sees the lamps that the emulated chain of shift registers lights.
#include <fmt/format.h>
#include <gmock/gmock.h>

#include <csignal>
#include <fstream>
#include <set>
#include <thread>

#include "acquisition/device/clock.h"
#include "rig/daemon/client.h"
#include "tests/firmware/board_fixture.h"
#include "tests/firmware/emulator/usb_testbed.h"
#include "tests/rig/cli/captured_frames.h"
#include "tests/support/child_process.h"
#include "tests/support/test_data.h"

namespace darkbox {
namespace {

namespace fs = std::filesystem;
using namespace std::chrono_literals;
using nlohmann::json;
using namespace test;
using lampctl::HostBoard;
using testing::HasSubstr;

constexpr int lamp_count = 9;

/// The camera's strobe line, as its file tells of it. Thread-hostile.
class StrobeLine {
public:
    explicit StrobeLine(fs::path file) : file_(std::move(file)) {}
    bool up(TimePoint t) {
        if (t >= look_again_) read(t);
        return period_ > 0 && t >= first_ && (t - first_).count() % period_ < exposed_;
    }

private:
    void read(TimePoint t) {
        look_again_ = t + 2ms;
        std::ifstream in(file_);
        Nanoseconds::rep first = 0;
        for (std::string line; std::getline(in, line) && !in.eof();)
            if (std::istringstream words(line); words >> first >> period_ >> exposed_)
                first_ = TimePoint(Nanoseconds(first));
    }

    fs::path file_;
    TimePoint look_again_;
    TimePoint first_;
    Nanoseconds::rep period_ = 0;
    Nanoseconds::rep exposed_ = 0;
};

class UsbSession : public testing::Test {
protected:
    void SetUp() override {
        if (!UsbTestbed::available()) GTEST_SKIP() << "runs under umockdev-wrapper";
        set_up("settled");
    }
    void set_up(const std::string& mode) {
        std::string toml = small_rig(lamp_count);
        const auto replace = [&](const std::string& old, const std::string& with) {
            ASSERT_NE(toml.find(old), std::string::npos) << old;
            toml.replace(toml.find(old), old.size(), with);
        };
        replace("[lamps]\ndriver = \"sim\"\n",
                "[lamps]\ndriver = \"usb\"\ndistant = true\n[lamps.usb]\nserial = \"HOST-1\"\nheartbeat_ms = 600\n");
        replace("[sim]\n", fmt::format("[capture]\nmode = \"{}\"\n[sim]\nreal_time = true\nlamps_seen = \"{}\"\n"
                                       "strobe_line = \"{}\"\n",
                                       mode, seen_.string(), strobe_line_.string()));
        std::ofstream(rig_) << toml;

        std::ofstream(seen_) << "0 0 0\n";
        bed_.emplace();
        board_ = bed_->plug_in(DARKBOX_LAMP_ELF, HostBoard::some_identity());
        bed_->board(board_).with_board([this](EmulatedBoard& board, EmulatedHost&) {
            board.on_lamps = [this](const LampsSeen& lamps) {
                crowded_ |= (lamps.lit & (lamps.lit - 1)) != 0;
                ever_lit_ |= lamps.lit;
                std::ofstream(seen_, std::ios::app)
                    << fmt::format("{} {:x} {}\n", when().time_since_epoch().count(), lamps.lit, lamps.level);
            };
        });
    }
    /// Of a switch of the lamps: as the host sees it, late when this machine is.
    virtual TimePoint when() { return SystemClock().now(); }
    void start() {
        daemon_.emplace(
            std::vector<std::string>{DARKBOXD_PROGRAM, "--config", rig_, "--socket", socket_, "--sessions", sessions_},
            folder_.path() / "daemon");
        const auto idle = [&] { return client_.answers() && client_.call("GET", "status").at("state") == "Idle"; };
        while (daemon_->running() && !idle()) std::this_thread::sleep_for(5ms);
        ASSERT_TRUE(daemon_->running()) << daemon_->err();
    }
    json darkbox(std::vector<std::string> arguments) const {
        arguments.insert(arguments.begin(), DARKBOX_PROGRAM);
        arguments.emplace_back("--json");
        ChildProcess process(arguments, folder_.path() / "command");
        const int status = process.wait();
        EXPECT_EQ(status, 0) << process.err();
        return status == 0 ? json::parse(process.out()) : json();
    }
    double error_of(const fs::path& session) const {
        darkbox({"process", session});
        return darkbox({"evaluate", session, "--no-held-out"}).at("mean_angular_error_deg");
    }
    /// That each frame was lit by its lamp alone, and wholly, by what the camera tells of the light.
    void expect_true_light(const Session& session) const {
        std::ifstream truth_file(session.folder() / "truth" / "lamps.json");
        std::map<std::uint64_t, json> burned;
        const json truth = json::parse(truth_file);
        for (const json& frame : truth.at("frames")) burned[frame.at("sequence")] = frame.at("lamps");
        for (const FrameRecord& frame : session.frames()) {
            const json& lamps = burned.at(frame.sequence);
            if (!frame.lamp) {
                EXPECT_EQ(lamps.size(), 0U) << frame.file;
                continue;
            }
            ASSERT_EQ(lamps.size(), 1U) << frame.file;
            EXPECT_EQ(lamps[0].at("lamp"), frame.lamp->value) << frame.file;
            EXPECT_NEAR(lamps[0].at("share"), 1.0, 1e-9) << "the whole exposure in its steady light: " << frame.file;
        }
    }
    std::uint64_t lit() {
        std::uint64_t lamps = 0;
        bed_->board(board_).with_board([&](EmulatedBoard& board, EmulatedHost&) { lamps = board.lamps().lit; });
        return lamps;
    }
    bool comes_true(const std::function<bool()>& holds, Nanoseconds patience) {
        const TimePoint end = SystemClock().now() + patience;
        while (!holds() && SystemClock().now() < end) std::this_thread::sleep_for(1ms);
        return holds();
    }

    TemporaryFolder folder_;
    const fs::path rig_ = folder_.path() / "rig.toml";
    const fs::path seen_ = folder_.path() / "lamps.txt";
    const fs::path strobe_line_ = folder_.path() / "strobe.txt";
    const fs::path socket_ = folder_.path() / "d.sock";
    const fs::path sessions_ = folder_.path() / "sessions";
    const DaemonClient client_{socket_};
    bool crowded_ = false;
    std::uint64_t ever_lit_ = 0;
    std::optional<UsbTestbed> bed_;
    int board_ = 0;
    std::optional<ChildProcess> daemon_;
};

TEST_F(UsbSession, IsCapturedProcessedAndAgreesWithTheTruth) {
    start();
    const json listed = darkbox({"lamps", "list", "--socket", socket_});
    EXPECT_EQ(listed.at("driver"), "usb");
    EXPECT_EQ(listed.at("lamps").size(), static_cast<std::size_t>(lamp_count));
    const json captured = darkbox({"capture", "--out", "torus", "--socket", socket_});
    ASSERT_EQ(captured.value("frames", 0), lamp_count + 2);
    EXPECT_FALSE(crowded_) << "two lamps at once";
    EXPECT_EQ(ever_lit_, (std::uint64_t{1} << lamp_count) - 1);
    EXPECT_EQ(lit(), 0U);

    const Session session = Session::open(sessions_ / "torus");
    EXPECT_NO_THROW(session.verify());
    expect_true_light(session);

    // The same rig with simulated lamps in virtual time shows the same light, and the same normals come of it.
    std::ofstream(folder_.path() / "simulated.toml") << small_rig(lamp_count);
    darkbox({"capture", "--standalone", "--rig", folder_.path() / "simulated.toml", "--out", sessions_ / "simulated"});
    expect_same_light(session, Session::open(sessions_ / "simulated"));
    const double error_deg = error_of(sessions_ / "torus");
    const double simulated_deg = error_of(sessions_ / "simulated");
    std::printf("session over USB: %d lamps, %.1f s, normals %.2f deg from the truth; with simulated lamps %.2f deg\n",
                lamp_count, captured.at("seconds").get<double>(), error_deg, simulated_deg);
    EXPECT_NEAR(error_deg, simulated_deg, 0.2);
}

/// The board hears the camera's strobe line and steps by itself.
class StrobedUsbSession : public UsbSession {
protected:
    void SetUp() override {
        if (!UsbTestbed::available()) GTEST_SKIP() << "runs under umockdev-wrapper";
        set_up("strobed");
        PacedBoard& board = bed_->board(board_);
        board.with_board([&](EmulatedBoard&, EmulatedHost&) {
            board.strobe_line = [line = StrobeLine(strobe_line_)](TimePoint t) mutable { return line.up(t); };
        });
    }
    /// The line and the steps are on the chip's time, be this machine late or not.
    TimePoint when() override { return bed_->board(board_).board_time(); }
};

TEST_F(StrobedUsbSession, TakesALampAFrame) {
    start();
    const json captured = darkbox({"capture", "--out", "torus", "--socket", socket_});
    ASSERT_EQ(captured.value("frames", 0), lamp_count + 2);
    EXPECT_FALSE(crowded_) << "two lamps at once";
    EXPECT_EQ(lit(), 0U);
    const Session session = Session::open(sessions_ / "torus");
    EXPECT_NO_THROW(session.verify());
    expect_true_light(session);
    int stepped = 0;
    for (const FrameRecord& frame : session.frames())
        stepped += frame.verification.find("strobe's step") != std::string::npos ? 1 : 0;
    std::printf("strobed session over USB: %d of %d lamps by the strobe\n", stepped, lamp_count);
    for (const SessionEvent& event : session.events()) std::printf("  %s\n", event.what.c_str());
    EXPECT_GE(stepped, 1) << "the others were repeated in settled mode, as a late machine has it";
}

TEST_F(UsbSession, AKilledDaemonLeavesTheLampsToTheBoard) {
    start();
    client_.call("POST", "captures", {{"name", "vase"}});
    ASSERT_TRUE(comes_true([&] { return lit() != 0; }, 20s));
    daemon_->signal(SIGKILL);
    EXPECT_TRUE(comes_true([&] { return lit() == 0; }, 1500ms)) << "heartbeat 600 ms";
    daemon_->wait();
    start();  // it goes on with the session by itself, and is idle afterwards
    ASSERT_TRUE(comes_true([&] { return fs::exists(sessions_ / "vase" / "tagmanifest-sha256.txt"); }, 20s));
    const Session session = Session::open(sessions_ / "vase");
    EXPECT_NO_THROW(session.verify());
    EXPECT_EQ(session.frames().size(), static_cast<std::size_t>(lamp_count + 2));
}

TEST_F(UsbSession, ACableThatIsPulledRepeatsTheShot) {
    start();
    client_.call("POST", "captures", {{"name", "knocked"}});
    ASSERT_TRUE(comes_true([&] { return lit() != 0; }, 20s));
    bed_->pull_cable(board_);
    std::this_thread::sleep_for(300ms);
    bed_->plug_cable(board_);
    const auto sealed = [&] { return fs::exists(sessions_ / "knocked" / "tagmanifest-sha256.txt"); };
    ASSERT_TRUE(comes_true(sealed, 60s)) << daemon_->err();
    const Session session = Session::open(sessions_ / "knocked");
    EXPECT_NO_THROW(session.verify());
    EXPECT_EQ(session.frames().size(), static_cast<std::size_t>(lamp_count + 2));
    std::string events;
    for (const SessionEvent& event : session.events()) events += event.what;
    EXPECT_THAT(events, HasSubstr("lamp controller")) << "the shot was taken again, and the session says why";
}

}  // namespace
}  // namespace darkbox
