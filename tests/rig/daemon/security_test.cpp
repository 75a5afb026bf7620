// The promise that nobody gets in: every row of the table is refused as it says, and the lamps are never touched.
#include <sys/wait.h>
#include <unistd.h>

#include <random>

#include "tests/rig/daemon/served_rig.h"

// After asio.h, which makes Boost 1.74 compile.
#include <boost/asio/read_until.hpp>

namespace darkbox {
namespace {

using nlohmann::json;
using testing::HasSubstr;
using testing::StartsWith;
using namespace test;
using Tcp = asio::ip::tcp;

class SecurityTest : public ServedRig {};

TEST_F(SecurityTest, LetsInWhoHasTheToken) {
    serve();
    EXPECT_THAT(get("/api/v1/status"), StartsWith("HTTP/1.1 200"));
    EXPECT_THAT(get("/api/v1/status", "Host: localhost:" + std::to_string(port_) + "\r\n" + with_token()),
                StartsWith("HTTP/1.1 200"));
    EXPECT_THAT(get("/api/v1/status", "Host: " + host() + "\r\nOrigin: http://" + host() + "\r\n" + with_token()),
                StartsWith("HTTP/1.1 200"));
    EXPECT_THAT(get("/metrics"), HasSubstr("darkbox_state{state=\"Idle\"} 1"));
}

TEST_F(SecurityTest, TurnsAwayEverybodyElse) {
    serve();
    const std::string ours = "Host: " + host() + "\r\n";
    const std::vector<std::pair<std::string, const char*>> table{
        {ours, "401"},                                                                    // no token
        {ours + "Authorization: Bearer " + std::string(64, 'b') + "\r\n", "401"},         // another token
        {ours + "Authorization: Bearer " + token_.substr(1) + "\r\n", "401"},             // a part of it
        {ours + "Authorization: Bearer " + token_ + "a\r\n", "401"},                      // too much of it
        {ours + "Authorization: Basic " + token_ + "\r\n", "401"},                        // another scheme
        {ours + "Authorization: \r\n", "401"},                                            // nothing
        {"Host: evil.example\r\n" + with_token(), "421"},                                 // DNS rebinding
        {"Host: evil.example:" + std::to_string(port_) + "\r\n" + with_token(), "421"},   // and with the port
        {"Host: 127.0.0.1\r\n" + with_token(), "421"},                                    // another port
        {with_token(), "421"},                                                            // no host at all
        {ours + "Origin: http://evil.example\r\n" + with_token(), "403"},                 // another site's page
        {ours + "Origin: null\r\n" + with_token(), "403"},                                // a sandboxed page
        {ours + "Origin: https://" + host() + "\r\n" + with_token(), "403"},              // another scheme
        {ours + "Origin: http://" + host() + ".evil.example\r\n" + with_token(), "403"},  // our name as a prefix
    };
    for (const auto& [headers, status] : table) {
        SCOPED_TRACE(headers);
        for (const char* target : {"/api/v1/status", "/metrics", "/api/v1/events", "/"})
            EXPECT_THAT(get(target, headers), StartsWith(std::string("HTTP/1.1 ") + status));
        // What would light lamps, and a WebSocket.
        EXPECT_THAT(exchange("POST /api/v1/captures HTTP/1.1\r\n" + headers +
                             "Content-Type: application/json\r\nContent-Length: 2\r\nConnection: close\r\n\r\n{}"),
                    StartsWith(std::string("HTTP/1.1 ") + status));
        EXPECT_THAT(get("/api/v1/events", headers + "Upgrade: websocket\r\nSec-WebSocket-Version: 13\r\n"
                                                    "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n"),
                    StartsWith(std::string("HTTP/1.1 ") + status));
    }
    // A form on another site can post without asking first, but not JSON.
    EXPECT_THAT(exchange("POST /api/v1/captures HTTP/1.1\r\n" + ours + with_token() +
                         "Content-Type: text/plain\r\nContent-Length: 2\r\nConnection: close\r\n\r\n{}"),
                StartsWith("HTTP/1.1 415"));
}

TEST_F(SecurityTest, NoPathLeavesASession) {
    serve();
    EXPECT_THAT(body_of(get("/api/v1/sessions/cup/files/data/frames/a.tif")), "0123456789");
    for (const char* path : {"/api/v1/sessions/cup/files/../../secret",
                             "/api/v1/sessions/cup/files/../secret",
                             "/api/v1/sessions/cup/files/%2e%2e/secret",
                             "/api/v1/sessions/cup/files/data/../../secret",
                             "/api/v1/sessions/cup/files/..%2f..%2fsecret",
                             "/api/v1/sessions/cup/files//etc/passwd",
                             "/api/v1/sessions/cup/files/%2fetc%2fpasswd",
                             "/api/v1/sessions/cup/files/link",
                             "/api/v1/sessions/cup/files/up/secret",
                             "/api/v1/sessions/elsewhere/files/secret",
                             "/api/v1/sessions/cup/files/data",
                             "/api/v1/sessions/cup/files/",
                             "/api/v1/sessions/../files/secret",
                             "/api/v1/sessions/%2e%2e/files/secret",
                             "/api/v1/sessions/.darkbox/files/catalog.sqlite",
                             "/api/v1/sessions/cup/files/..%2f.darkbox%2fcatalog.sqlite",
                             "/api/v1/sessions/cup/files/data%00/frames",
                             "/api/v1/sessions/cup/files/%",
                             "/api/v1/sessions/cup/files/%zz",
                             "/api/v1/sessions/elsewhere/files"}) {
        const std::string answer = get(path);
        EXPECT_THAT(answer, StartsWith("HTTP/1.1 40")) << path;
        EXPECT_EQ(answer.find("\r\n\r\nsecret"), answer.npos) << path;
    }
    EXPECT_EQ(get("/api/v1/sessions/cup/files").find("link"), std::string::npos);
}

TEST_F(SecurityTest, ServesRangesOfFiles) {
    serve();
    const auto range = [this](const std::string& bytes) {
        return get("/api/v1/sessions/cup/files/data/frames/a.tif",
                   "Host: " + host() + "\r\n" + with_token() + "Range: " + bytes + "\r\n");
    };
    for (const auto& [asked, told] : std::vector<std::pair<std::string, std::string>>{
             {"bytes=2-4", "234"}, {"bytes=7-", "789"}, {"bytes=-3", "789"}, {"bytes=0-99", "0123456789"}}) {
        const std::string answer = range(asked);
        EXPECT_THAT(answer, StartsWith("HTTP/1.1 206")) << asked;
        EXPECT_EQ(body_of(answer), told) << asked;
    }
    EXPECT_THAT(range("bytes=2-4"), HasSubstr("Content-Range: bytes 2-4/10"));
    for (const char* beyond : {"bytes=10-", "bytes=99999999999999999999-", "bytes=-0"}) {
        const std::string answer = range(beyond);
        EXPECT_TRUE(answer.starts_with("HTTP/1.1 416") || answer.starts_with("HTTP/1.1 200")) << beyond;
    }
    for (const char* nonsense : {"bytes=", "bytes=-", "bytes=4-2", "bytes=a-b", "lines=1-2", "bytes=0-1,3-4"})
        EXPECT_THAT(range(nonsense), StartsWith("HTTP/1.1 200")) << nonsense;
}

TEST_F(SecurityTest, OversizedAndSlowRequestsEnd) {
    options_.deadline = std::chrono::milliseconds(100);
    serve();
    const std::string head = "POST /api/v1/captures HTTP/1.1\r\nHost: " + host() + "\r\n" + with_token() +
                             "Content-Type: application/json\r\n";
    EXPECT_THAT(exchange(head + "Content-Length: 65537\r\n\r\n"), StartsWith("HTTP/1.1 413"));
    EXPECT_THAT(exchange("GET / HTTP/1.1\r\nX: " + std::string(9000, 'x') + "\r\n\r\n"), StartsWith("HTTP/1.1 431"));
    EXPECT_EQ(exchange("GET /api/v1/sta"), "");
    EXPECT_EQ(exchange(head + "Content-Length: 10\r\n\r\n{"), "");
    EXPECT_TRUE(answers());
}

TEST_F(SecurityTest, AsksForPatienceAboveTheRate) {
    options_.requests_per_second = 1;
    options_.requests_at_once = 5;
    serve();
    int refused = 0;
    for (int i = 0; i < 12; ++i) refused += get("/api/v1/lamps").starts_with("HTTP/1.1 429") ? 1 : 0;
    EXPECT_GE(refused, 5);
    EXPECT_TRUE(answers());  // the command line has its own door
}

TEST_F(SecurityTest, KnowsItsPeersByTheKernelsWord) {
    EXPECT_TRUE(may_connect({}, ::geteuid(), 0));
    EXPECT_TRUE(may_connect({}, 0, 0));
    const uid_t nobody = 65534;
    if (::geteuid() != nobody) {
        EXPECT_FALSE(may_connect({}, nobody, 65534));
    }
    EXPECT_TRUE(may_connect({.group = 65534}, nobody, 65534));
    EXPECT_FALSE(may_connect({.group = 12345}, 4000000, 4000000));
}

TEST_F(SecurityTest, AnotherUserFindsTheSocketClosed) {
    if (::geteuid() != 0) GTEST_SKIP() << "only root can become another user";
    serve();
    fs::permissions(folder_.path(), fs::perms::all);
    // As it is, and as if its mode had been opened by mistake: the kernel's word on the peer still counts.
    for (const auto mode : {fs::perms::owner_read | fs::perms::owner_write, fs::perms::all}) {
        fs::permissions(options_.socket, mode);
        const pid_t child = ::fork();
        if (child == 0) {
            if (::setgid(65534) != 0 || ::setuid(65534) != 0) ::_exit(9);
            try {
                ::_exit(DaemonClient(options_.socket).request("GET", "status").status == 200 ? 1 : 0);
            } catch (const std::exception&) {
                ::_exit(0);
            }
        }
        int status = 0;
        ::waitpid(child, &status, 0);
        EXPECT_TRUE(WIFEXITED(status));
        EXPECT_EQ(WEXITSTATUS(status), 0);
    }
}

TEST_F(SecurityTest, ListensOnLoopbackOnly) {
    for (const char* address : {"0.0.0.0", "192.168.1.1", "::", "example.org", ""}) {
        options_.tcp->address = address;
        asio::io_context io;
        EXPECT_THROW(HttpServer(io, options_, {}, log_, metrics_), InputError) << address;
    }
}

TEST_F(SecurityTest, TheTokenIsItsOwnersOnly) {
    const fs::path file = folder_.path() / "token";
    const std::string token = token_in(file);
    EXPECT_EQ(token.size(), 64u);
    EXPECT_EQ(token_in(file), token);
    EXPECT_EQ(fs::status(file).permissions(), fs::perms::owner_read | fs::perms::owner_write);
    fs::permissions(file, fs::perms::others_read, fs::perm_options::add);
    EXPECT_THROW(token_in(file), InputError);
    fs::permissions(file, fs::perms::owner_read | fs::perms::owner_write);
    std::ofstream(file) << "short\n";
    EXPECT_THROW(token_in(file), InputError);
}

// Random bytes, and good requests damaged at random places.

TEST_F(SecurityTest, SurvivesDamagedRequests) {
    options_.deadline = std::chrono::milliseconds(20);
    options_.requests_per_second = 1e9;
    options_.requests_at_once = 1e9;
    serve();
    const std::string body = R"({"kind":"export","session":"cup","format":"ply","x":[1,{"y":null}]})";
    const std::string good = "POST /api/v1/jobs HTTP/1.1\r\nHost: " + host() + "\r\n" + with_token() +
                             "Content-Type: application/json\r\nContent-Length: " + std::to_string(body.size()) +
                             "\r\nConnection: close\r\n\r\n" + body;
    std::mt19937 random(7);
    for (int i = 0; i < 300; ++i) {
        std::string bytes = good;
        const std::size_t first = i % 2 == 0 ? 0 : good.size() - body.size();  // anywhere, or in the JSON
        for (unsigned n = 0; n <= random() % 4; ++n) {
            const std::size_t place = first + random() % (bytes.size() - first);
            if (random() % 3 == 0) {
                bytes.erase(place, 1 + random() % 5);
            } else {
                bytes[place] = static_cast<char>(random());
            }
        }
        const std::string answer = exchange(bytes);
        EXPECT_TRUE(answer.empty() || answer.starts_with("HTTP/1.1 4") || answer.starts_with("HTTP/1.1 2")) << answer;
        EXPECT_FALSE(answer.starts_with("HTTP/1.1 5")) << bytes;
    }
    EXPECT_TRUE(answers());
}

class WebSocketTest : public SecurityTest {
protected:
    void SetUp() override {
        options_.heartbeat = std::chrono::milliseconds(100);  // and twice that for who begins a frame and never ends it
        SecurityTest::SetUp();
    }
    /// A connection after its handshake: a client says nothing before it was answered.
    Tcp::socket open(asio::io_context& io, const std::string& more = "") {
        Tcp::socket socket(io);
        socket.connect({asio::ip::make_address("127.0.0.1"), port_});
        asio::write(socket,
                    asio::buffer("GET /api/v1/events?after=0 HTTP/1.1\r\nHost: " + host() +
                                 "\r\nConnection: Upgrade\r\nUpgrade: websocket\r\nSec-WebSocket-Version: 13\r\n"
                                 "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n" +
                                 (more.empty() ? with_token() : more) + "\r\n"));
        head_.clear();
        boost::system::error_code error;
        asio::read_until(socket, asio::dynamic_buffer(head_), "\r\n\r\n", error);
        return socket;
    }
    /// All that came since open().
    std::string read_until_closed(Tcp::socket& socket) const {
        boost::system::error_code error;
        std::string answer = head_;
        asio::read(socket, asio::dynamic_buffer(answer), error);
        return answer;
    }
    /// As a client sends it: masked, with a mask of zeros.
    static std::string frame(unsigned char first_byte, const std::string& payload) {
        std::string bytes{static_cast<char>(first_byte), static_cast<char>(0x80 | payload.size())};
        return bytes + std::string(4, '\0') + payload;
    }

private:
    std::string head_;
};

TEST_F(WebSocketTest, TellsEventsAndClosesWhenAsked) {
    serve();
    asio::io_context io;
    Tcp::socket socket = open(io);
    asio::write(socket, asio::buffer(frame(0x88, "")));
    const std::string answer = read_until_closed(socket);
    EXPECT_THAT(answer, StartsWith("HTTP/1.1 101"));
    EXPECT_THAT(answer, HasSubstr("s3pPLMBiTxaQ9kYGzzhZRbK+xOo="));
    EXPECT_THAT(answer, HasSubstr("\"event\":\"state\""));
}

TEST_F(WebSocketTest, TakesTheTokenAsAProtocolFromABrowser) {
    serve();
    asio::io_context io;
    Tcp::socket socket = open(
        io, "Origin: http://" + host() + "\r\nSec-WebSocket-Protocol: darkbox.v1, darkbox.token." + token_ + "\r\n");
    asio::write(socket, asio::buffer(frame(0x88, "")));
    const std::string answer = read_until_closed(socket);
    EXPECT_THAT(answer, StartsWith("HTTP/1.1 101"));
    EXPECT_THAT(answer, HasSubstr("Sec-WebSocket-Protocol: darkbox.v1\r\n"));
    EXPECT_EQ(answer.find(token_), answer.npos);
    Tcp::socket other = open(io, "Sec-WebSocket-Protocol: darkbox.v1, darkbox.token." + std::string(64, 'b') + "\r\n");
    EXPECT_THAT(read_until_closed(other), StartsWith("HTTP/1.1 401"));
}

TEST_F(WebSocketTest, HangsUpOnWhoSpeaks) {
    serve();
    asio::io_context io;
    for (const std::string& said : {frame(0x81, "hello"), frame(0x82, "\x01\x02"), frame(0x81, ""),
                                    std::string("\x81\xfe\xff\xff", 4), std::string("\x81\xff\x7f\xff\xff\xff", 6),
                                    std::string(200, '\xff'), std::string(200, '\0'), frame(0x8b, "")}) {
        Tcp::socket socket = open(io);
        boost::system::error_code error;
        asio::write(socket, asio::buffer(said), error);
        EXPECT_THAT(read_until_closed(socket), StartsWith("HTTP/1.1 101"));
    }
    EXPECT_TRUE(answers());
}

TEST_F(WebSocketTest, SurvivesRandomFrames) {
    serve();
    asio::io_context io;
    std::mt19937 random(11);
    for (int i = 0; i < 60; ++i) {
        Tcp::socket socket = open(io);
        std::string bytes(random() % 64, '\0');
        for (char& byte : bytes) byte = static_cast<char>(random());
        if (i % 2 == 0 && !bytes.empty()) bytes[0] = static_cast<char>(0x80 | random() % 16);
        boost::system::error_code error;
        asio::write(socket, asio::buffer(bytes), error);
        socket.shutdown(Tcp::socket::shutdown_send, error);
        read_until_closed(socket);
    }
    EXPECT_TRUE(answers());
    EXPECT_TRUE(eventually(
        [this] { return metrics_.text(*service_).find("darkbox_event_listeners 0\n") != std::string::npos; }));
}

TEST_F(WebSocketTest, EndsWhenTheServiceStops) {
    serve();
    asio::io_context io;
    Tcp::socket socket = open(io);
    service_->request_stop();
    EXPECT_THAT(read_until_closed(socket), StartsWith("HTTP/1.1 101"));
}

}  // namespace
}  // namespace darkbox
