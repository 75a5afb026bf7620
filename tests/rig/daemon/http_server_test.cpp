#include "rig/daemon/http_server.h"

#include <gmock/gmock.h>
#include <sys/stat.h>

#include <boost/asio/read.hpp>
#include <boost/asio/read_until.hpp>
#include <boost/asio/write.hpp>
#include <fstream>
#include <thread>

#include "acquisition/frame/error.h"
#include "rig/daemon/client.h"
#include "tests/rig/daemon/fake_rig.h"
#include "tests/support/test_data.h"

namespace darkbox {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::StartsWith;
using namespace test;
using Follow = DaemonClient::Follow;

/// A server on a real socket, its loop on a thread of its own.
class HttpServerTest : public testing::Test {
protected:
    void SetUp() override {
        options_.socket = folder_.path() / "d.sock";
        fs::create_directory(folder_.path() / "sessions");
        service_.emplace(open_fake(script_), ServiceOptions{.sessions = folder_.path() / "sessions"}, log_);
        api_.emplace(rig_, *service_, metrics_);
        ASSERT_TRUE(reaches(*service_, ServiceState::idle));
    }
    void serve() {
        server_.emplace(
            io_, options_, [this](const ApiRequest& request) { return api_->answer(request); }, log_, metrics_);
        loop_ = std::jthread([this] { io_.run(); });
    }
    void TearDown() override {
        service_->request_stop();
        if (!server_) return;
        asio::post(io_, [this] { server_->stop(); });
        loop_.join();  // the loop must run out of work by itself
        server_.reset();
        EXPECT_FALSE(fs::exists(options_.socket));
    }

    UnixProtocol::socket connect() {
        UnixProtocol::socket socket(client_io_);
        socket.connect(UnixProtocol::endpoint(options_.socket.string()));
        return socket;
    }
    /// Sends bytes as they are and reads until the server hangs up.
    std::string exchange(const std::string& bytes) {
        UnixProtocol::socket socket = connect();
        boost::system::error_code error;
        asio::write(socket, asio::buffer(bytes), error);
        std::string answer;
        asio::read(socket, asio::dynamic_buffer(answer), error);
        return answer;
    }
    DaemonClient client() const { return DaemonClient(options_.socket); }

    TemporaryFolder folder_;
    FakeRigScript script_;
    EventLog log_;
    RigDescription rig_ = parse_rig(simulated_rig_toml(4), "rig.toml");
    HttpServerOptions options_;
    std::optional<Service> service_;
    Metrics metrics_;
    std::optional<Api> api_;
    asio::io_context io_;
    asio::io_context client_io_;
    std::optional<HttpServer> server_;
    std::jthread loop_;
};

TEST_F(HttpServerTest, AnswersTheClient) {
    serve();
    EXPECT_TRUE(client().answers());
    EXPECT_EQ(client().call("GET", "status").at("state"), "Idle");
    EXPECT_EQ(client().request("GET", "nothing").status, 404);
    EXPECT_THROW(client().call("GET", "nothing"), InputError);
}

TEST_F(HttpServerTest, IsOpenToItsOwnerOnly) {
    serve();
    struct stat status{};
    ASSERT_EQ(::stat(options_.socket.c_str(), &status), 0);
    EXPECT_EQ(status.st_mode & 0777, 0600u);
}

TEST_F(HttpServerTest, TellsACaptureInOrderToWhoeverListens) {
    script_.body = [](const auto&, const WorkContext& work) {
        for (std::size_t i = 0; i < 300; ++i) work.tell({.stage = "capture", .done = i, .total = 300, .detail = ""});
    };
    serve();
    const json job = client().call("POST", "captures", {{"object", "vase"}});
    std::vector<std::string> types;
    std::size_t done = 0;
    std::uint64_t number = job.at("event");
    client().follow_events(number, {.event = [&](const json& event) {
                               EXPECT_EQ(event.at("number"), ++number);
                               const std::string type = event.at("event");
                               if (type == "progress") {
                                   EXPECT_EQ(event.at("done"), done++);
                               }
                               if (types.empty() || types.back() != type) types.push_back(type);
                               return type == "done" ? Follow::leave : Follow::go_on;
                           }});
    EXPECT_THAT(types, ElementsAre("state", "progress", "lamps", "state", "done"));
    EXPECT_EQ(done, 300u);
}

TEST_F(HttpServerTest, RefusesASecondCaptureAndCancelsTheFirst) {
    script_.body = run_until_cancelled;
    serve();
    const json job = client().call("POST", "captures", {{"object", "vase"}});
    const auto second = client().request("POST", "captures", {{"object", "vase"}});
    EXPECT_EQ(second.status, 409);
    EXPECT_THAT(second.body.at("detail").get<std::string>(), HasSubstr("Busy"));
    client().call("DELETE", "jobs/" + job.at("id").dump());
    ASSERT_TRUE(reaches(*service_, ServiceState::idle));
    EXPECT_EQ(client().call("GET", "jobs/" + job.at("id").dump()).at("state"), "cancelled");
}

TEST_F(HttpServerTest, EndsStreamsWhenTheServiceStops) {
    script_.body = run_until_cancelled;
    serve();
    client().call("POST", "captures", {{"object", "vase"}});
    std::string last;
    client().follow_events(0, {.event = [&](const json& event) {
                               last = event.at("event");
                               if (last == "state" && event.at("state") == "Busy") service_->request_stop();
                               return Follow::go_on;
                           }});
    EXPECT_EQ(last, "lamps");
    EXPECT_FALSE(script_.lit);
}

TEST_F(HttpServerTest, SendsHeartbeats) {
    options_.heartbeat = std::chrono::milliseconds(5);
    serve();
    UnixProtocol::socket socket = connect();
    asio::write(socket, asio::buffer(std::string("GET /api/v1/events?after=99 HTTP/1.1\r\nHost: x\r\n\r\n")));
    std::string answer;
    asio::read_until(socket, asio::dynamic_buffer(answer), "1\r\n\n\r\n1\r\n\n\r\n");
    EXPECT_THAT(answer, StartsWith("HTTP/1.1 200"));
}

TEST_F(HttpServerTest, SurvivesWhatIsNotHttp) {
    serve();
    const std::vector<std::string> noise{"hello\r\n\r\n", std::string(100, '\0'), "GET / HTTP/9.9\r\n\r\n",
                                         "GET /api/v1/status HTTP/1.1\r\nContent-Length: -5\r\n\r\n",
                                         "POST /api/v1/captures HTTP/1.1\r\nTransfer-Encoding: chunked\r\n\r\nzz\r\n"};
    for (const std::string& bytes : noise) EXPECT_THAT(exchange(bytes), StartsWith("HTTP/1.1 400")) << bytes;
    EXPECT_EQ(client().call("GET", "status").at("state"), "Idle");
}

TEST_F(HttpServerTest, RefusesWhatIsTooLarge) {
    serve();
    const std::string head = "POST /api/v1/captures HTTP/1.1\r\nContent-Type: application/json\r\n";
    EXPECT_THAT(exchange(head + "Content-Length: 65537\r\n\r\n"), StartsWith("HTTP/1.1 413"));
    EXPECT_THAT(exchange("GET / HTTP/1.1\r\nX: " + std::string(9000, 'x') + "\r\n\r\n"), StartsWith("HTTP/1.1 431"));
    EXPECT_EQ(client().call("GET", "status").at("state"), "Idle");
}

TEST_F(HttpServerTest, HangsUpOnASlowClient) {
    options_.deadline = std::chrono::milliseconds(50);
    serve();
    EXPECT_EQ(exchange("GET /api/v1/sta"), "");
    EXPECT_EQ(exchange("POST /api/v1/captures HTTP/1.1\r\nContent-Length: 10\r\n\r\n{"), "");
    EXPECT_EQ(client().call("GET", "status").at("state"), "Idle");
}

TEST_F(HttpServerTest, RefusesTooManyConnections) {
    options_.max_connections = 2;
    serve();
    {
        const UnixProtocol::socket first = connect();
        const UnixProtocol::socket second = connect();
        EXPECT_EQ(client().request("GET", "status").status, 503);
    }
    EXPECT_TRUE(eventually([this] { return client().request("GET", "status").status == 200; }));
}

TEST_F(HttpServerTest, AnswersTwoRequestsOfOneConnection) {
    serve();
    const std::string request = "GET /api/v1/lamps HTTP/1.1\r\nHost: x\r\n";
    const std::string answer = exchange(request + "\r\n" + request + "Connection: close\r\n\r\n");
    EXPECT_THAT(answer, StartsWith("HTTP/1.1 200"));
    EXPECT_NE(answer.find("HTTP/1.1 200", 10), answer.npos);
}

TEST_F(HttpServerTest, TakesTheDeadsPlaceButNotTheLivings) {
    {
        asio::io_context io;
        UnixProtocol::acceptor dead(io, UnixProtocol::endpoint(options_.socket.string()));
    }
    ASSERT_TRUE(fs::exists(options_.socket));
    EXPECT_FALSE(client().answers());
    serve();
    EXPECT_TRUE(client().answers());
    asio::io_context io;
    EXPECT_THROW(SocketFile(io, options_.socket), InputError);
    EXPECT_TRUE(client().answers());
}

TEST_F(HttpServerTest, LeavesWhatIsNoSocketAlone) {
    std::ofstream(options_.socket) << "precious";
    asio::io_context io;
    EXPECT_THROW(SocketFile(io, options_.socket), InputError);
    EXPECT_TRUE(fs::exists(options_.socket));
    EXPECT_THROW(SocketFile(io, folder_.path() / std::string(120, 'x')), InputError);
    EXPECT_THROW(SocketFile(io, folder_.path() / "a" / "b" / "c.sock"), Error);
}

TEST(DaemonClient, SaysWhenNobodyAnswers) {
    const TemporaryFolder folder;
    const DaemonClient client(folder.path() / "none.sock");
    EXPECT_FALSE(client.answers());
    EXPECT_THROW(client.call("GET", "status"), Error);
    EXPECT_FALSE(DaemonClient(std::string(200, 'x')).answers());
}

}  // namespace
}  // namespace darkbox
