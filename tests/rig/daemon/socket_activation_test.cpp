// darkboxd on sockets that its parent opened, as systemd does by darkboxd.socket.
#include <arpa/inet.h>
#include <fcntl.h>
#include <gmock/gmock.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <fstream>
#include <future>
#include <thread>

#include "acquisition/device/unique_fd.h"
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

/// Far from the numbers that a child gets.
UniqueFd moved_away(int fd) {
    constexpr int far = 100;
    const UniqueFd here(fd);
    return UniqueFd(::fcntl(here.get(), F_DUPFD_CLOEXEC, far));
}

UniqueFd listening_at(const fs::path& path) {
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    path.string().copy(address.sun_path, sizeof address.sun_path - 1);
    UniqueFd fd = moved_away(::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0));
    EXPECT_EQ(::bind(fd.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
    EXPECT_EQ(::listen(fd.get(), 8), 0);
    return fd;
}

UniqueFd listening_on(const char* host) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    ::inet_pton(AF_INET, host, &address.sin_addr);
    UniqueFd fd = moved_away(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0));
    EXPECT_EQ(::bind(fd.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
    EXPECT_EQ(::listen(fd.get(), 8), 0);
    return fd;
}

unsigned short port_of(const UniqueFd& fd) {
    sockaddr_in address{};
    socklen_t size = sizeof address;
    EXPECT_EQ(::getsockname(fd.get(), reinterpret_cast<sockaddr*>(&address), &size), 0);
    return ntohs(address.sin_port);
}

/// One request by TCP, and all that comes back.
std::string asked(unsigned short port, const std::string& request) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(port);
    ::inet_pton(AF_INET, "127.0.0.1", &address.sin_addr);
    const UniqueFd fd(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0));
    EXPECT_EQ(::connect(fd.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
    EXPECT_EQ(::write(fd.get(), request.data(), request.size()), static_cast<ssize_t>(request.size()));
    std::string answer;
    char piece[512];
    for (ssize_t got = 0; (got = ::read(fd.get(), piece, sizeof piece)) > 0;)
        answer.append(piece, static_cast<std::size_t>(got));
    return answer;
}

class ActivationTest : public testing::Test {
protected:
    ActivationTest() { std::ofstream(rig_) << small_rig(4); }

    /// darkboxd, handed these sockets as systemd hands them: LISTEN_PID is the very process.
    void start(const std::vector<int>& sockets, const std::vector<std::string>& more = {}) {
        const std::string shell = "LISTEN_PID=$$ LISTEN_FDS=" + std::to_string(sockets.size()) + " exec \"$@\"";
        std::vector<std::string> command{"/bin/sh",
                                         "-c",
                                         shell,
                                         "sh",
                                         DARKBOXD_PROGRAM,
                                         "--config",
                                         rig_,
                                         "--sessions",
                                         folder_.path() / "sessions"};
        command.insert(command.end(), more.begin(), more.end());
        daemon_.emplace(command, folder_.path() / "daemon", sockets);
    }
    int stop() {
        daemon_->signal(SIGTERM);
        return daemon_->wait();
    }
    json status() const { return client_.call("GET", "status"); }

    TemporaryFolder folder_;
    const fs::path rig_ = folder_.path() / "rig.toml";
    const fs::path socket_ = folder_.path() / "d.sock";
    const DaemonClient client_{socket_, std::chrono::seconds(60)};
    std::optional<ChildProcess> daemon_;
};

TEST_F(ActivationTest, NobodyIsTurnedAwayWhileItStartsAndRestarts) {
    const UniqueFd listening = listening_at(socket_);
    for (int life = 0; life < 2; ++life) {
        // Who asks now waits for a daemon that is not there yet.
        auto early = std::async(std::launch::async, [this] { return status(); });
        std::this_thread::sleep_for(std::chrono::milliseconds(50));
        start({listening.get()});
        EXPECT_TRUE(early.get().contains("state")) << daemon_->err();
        EXPECT_EQ(stop(), 0) << daemon_->err();
        EXPECT_TRUE(fs::exists(socket_)) << "the file is its parent's";
    }
    start({listening.get()});
    status();
    daemon_->signal(SIGKILL);
    daemon_->wait();
    auto waiting = std::async(std::launch::async, [this] { return status(); });
    start({listening.get()});
    EXPECT_TRUE(waiting.get().contains("state"));
    EXPECT_EQ(stop(), 0);
}

TEST_F(ActivationTest, SaysWhereItListensInsteadOfWhereItWasTold) {
    const UniqueFd listening = listening_at(socket_);
    start({listening.get()}, {"--socket", folder_.path() / "other.sock"});
    status();
    EXPECT_EQ(stop(), 0);
    EXPECT_THAT(daemon_->err(), HasSubstr("listens where systemd does"));
    EXPECT_FALSE(fs::exists(folder_.path() / "other.sock"));
}

TEST_F(ActivationTest, AsksForTheTokenOnATcpSocket) {
    const UniqueFd local = listening_at(socket_);
    const UniqueFd tcp = listening_on("127.0.0.1");
    start({local.get(), tcp.get()});
    status();
    const std::string head =
        "GET /api/v1/status HTTP/1.1\r\nConnection: close\r\nHost: 127.0.0.1:" + std::to_string(port_of(tcp)) + "\r\n";
    EXPECT_THAT(asked(port_of(tcp), head + "\r\n"), testing::StartsWith("HTTP/1.1 401"));
    std::string token;
    std::ifstream(folder_.path() / "darkbox.token") >> token;
    EXPECT_THAT(asked(port_of(tcp), head + "Authorization: Bearer " + token + "\r\n\r\n"),
                testing::StartsWith("HTTP/1.1 200"));
    EXPECT_EQ(stop(), 0);
}

TEST_F(ActivationTest, RefusesSocketsThatItMayNotUse) {
    const UniqueFd open = listening_on("0.0.0.0");
    start({open.get()}, {"--socket", socket_});
    EXPECT_EQ(daemon_->wait(), 1);
    EXPECT_THAT(daemon_->err(), HasSubstr("is not a loopback address, and there is no certificate"));

    const UniqueFd datagrams = moved_away(::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0));
    start({datagrams.get()}, {"--socket", socket_});
    EXPECT_EQ(daemon_->wait(), 1);
    EXPECT_THAT(daemon_->err(), HasSubstr("no listening Unix or TCP socket"));

    const UniqueFd first = listening_at(folder_.path() / "a.sock");
    const UniqueFd second = listening_at(folder_.path() / "b.sock");
    start({first.get(), second.get()});
    EXPECT_EQ(daemon_->wait(), 1);
    EXPECT_THAT(daemon_->err(), HasSubstr("one too many of its kind"));
}

TEST_F(ActivationTest, IsStartedBySystemdsOwnProgram) {
    const fs::path program = "/usr/bin/systemd-socket-activate";
    if (!fs::exists(program)) GTEST_SKIP() << "systemd-socket-activate is not installed";
    daemon_.emplace(std::vector<std::string>{program, "-l", socket_, DARKBOXD_PROGRAM, "--config", rig_, "--sessions",
                                             folder_.path() / "sessions"},
                    folder_.path() / "daemon");
    for (int i = 0; i < 1000 && !fs::exists(socket_); ++i) std::this_thread::sleep_for(std::chrono::milliseconds(10));
    EXPECT_TRUE(status().contains("state")) << daemon_->err();
    EXPECT_EQ(stop(), 0);
}

}  // namespace
}  // namespace darkbox
