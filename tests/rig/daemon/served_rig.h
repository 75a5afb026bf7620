#pragma once

#include <gmock/gmock.h>

#include <fstream>
#include <thread>

#include "acquisition/frame/error.h"
#include "rig/daemon/client.h"
#include "rig/daemon/http_server.h"
#include "tests/rig/daemon/fake_rig.h"
#include "tests/support/test_data.h"

// After asio.h, which makes Boost 1.74 compile.
#include <boost/asio/read.hpp>
#include <boost/asio/write.hpp>

namespace darkbox::test {

namespace fs = std::filesystem;

/// A daemon without hardware behind both of its sockets, and one session beside files that nobody may get at. A test
/// that lit a lamp, or began a capture, has failed.
class ServedRig : public testing::Test {
protected:
    void SetUp() override {
        fs::create_directories(sessions_ / "cup" / "data" / "frames");
        std::ofstream(sessions_ / "cup" / "tagmanifest-sha256.txt") << "";
        std::ofstream(sessions_ / "cup" / "data" / "frames" / "a.tif") << "0123456789";
        std::ofstream(folder_.path() / "secret") << "secret";
        std::ofstream(sessions_ / "secret") << "secret";
        fs::create_symlink(folder_.path() / "secret", sessions_ / "cup" / "link");
        fs::create_directory_symlink(folder_.path(), sessions_ / "cup" / "up");
        fs::create_directory_symlink(folder_.path(), sessions_ / "elsewhere");
        options_.socket = folder_.path() / "d.sock";
        options_.tcp = TcpListen{.address = "127.0.0.1", .port = 0, .token = token_};
        options_.deadline = std::chrono::milliseconds(2000);
        service_.emplace(open_fake(script_), ServiceOptions{.sessions = sessions_}, log_);
        api_.emplace(rig_, *service_, metrics_);
        ASSERT_TRUE(reaches(*service_, ServiceState::idle));
    }
    void serve() {
        server_.emplace(
            io_, options_, [this](const ApiRequest& request) { return api_->answer(request); }, log_, metrics_);
        port_ = server_->port();
        loop_ = std::jthread([this] { io_.run(); });
    }
    void TearDown() override {
        service_->request_stop();
        if (server_) {
            asio::post(io_, [this] { server_->stop(); });
            loop_.join();
            server_.reset();
        }
        EXPECT_EQ(script_.captures, 0);
        EXPECT_FALSE(script_.lit);
    }

    /// Sends bytes as they are and reads until the server hangs up.
    std::string exchange(const std::string& bytes) const {
        asio::io_context io;
        asio::ip::tcp::socket socket(io);
        socket.connect({asio::ip::make_address("127.0.0.1"), port_});
        boost::system::error_code error;
        asio::write(socket, asio::buffer(bytes), error);
        std::string answer;
        asio::read(socket, asio::dynamic_buffer(answer), error);
        return answer;
    }
    std::string host() const { return "127.0.0.1:" + std::to_string(port_); }
    std::string with_token() const { return "Authorization: Bearer " + token_ + "\r\n"; }
    std::string get(const std::string& target, const std::string& headers) const {
        return exchange("GET " + target + " HTTP/1.1\r\n" + headers + "Connection: close\r\n\r\n");
    }
    std::string get(const std::string& target) const { return get(target, "Host: " + host() + "\r\n" + with_token()); }
    bool answers() const { return DaemonClient(options_.socket).request("GET", "status").status == 200; }
    static std::string body_of(const std::string& answer) { return answer.substr(answer.find("\r\n\r\n") + 4); }

    TemporaryFolder folder_;
    const fs::path sessions_ = folder_.path() / "sessions";
    const std::string token_ = std::string(64, 'a');
    FakeRigScript script_;
    EventLog log_;
    RigDescription rig_ = parse_rig(simulated_rig_toml(4), "rig.toml");
    HttpServerOptions options_;
    Metrics metrics_;
    std::optional<Service> service_;
    std::optional<Api> api_;
    asio::io_context io_;
    std::optional<HttpServer> server_;
    std::jthread loop_;
    unsigned short port_ = 0;
};

}  // namespace darkbox::test
