// The door for other machines: TLS by certificates that openssl makes, as people make them.
#include "rig/daemon/tls.h"

#include <fmt/format.h>
#include <sys/stat.h>

#include <cstdio>
#include <random>

#include "tests/rig/daemon/served_rig.h"

// After asio.h, which makes Boost 1.74 compile.
#include <boost/asio/read_until.hpp>
#include <boost/asio/ssl.hpp>

namespace darkbox {
namespace {

using testing::HasSubstr;
using testing::Not;
using testing::StartsWith;
using namespace test;
using Tcp = asio::ip::tcp;
using boost::system::error_code;
using std::chrono::system_clock;

struct ShellEnd {
    int status;
    std::string out;
};

ShellEnd shell(const std::string& command) {
    FILE* pipe = ::popen((command + " 2>&1").c_str(), "r");
    if (pipe == nullptr) return {-1, ""};
    std::string out;
    for (int c = std::fgetc(pipe); c != EOF; c = std::fgetc(pipe)) out += static_cast<char>(c);
    return {::pclose(pipe), out};
}

void run(const std::string& command) {
    const ShellEnd end = shell(command);
    ASSERT_EQ(end.status, 0) << command << "\n" << end.out;
}

/// As a person makes one for a rig in a laboratory.
TlsFiles make_certificate(const fs::path& folder, const std::string& name,
                          const std::string& names = "DNS:localhost,DNS:*.lab.example,IP:127.0.0.1,IP:::1") {
    const TlsFiles files{.certificate = folder / (name + ".crt"), .key = folder / (name + ".key")};
    run(fmt::format(
        "umask 077; openssl req -x509 -newkey ec -pkeyopt ec_paramgen_curve:prime256v1 -nodes -days 30 "
        "-subj /CN=rig -keyout {} -out {} {}",
        files.key.string(), files.certificate.string(), names.empty() ? "" : "-addext subjectAltName=" + names));
    return files;
}

class TlsTest : public ServedRig {
protected:
    using Stream = asio::ssl::stream<Tcp::socket>;

    void SetUp() override {
        files_ = make_certificate(folder_.path(), "rig");
        ServedRig::SetUp();
        options_.tcp->tls = files_;
    }

    Tcp::socket connect() {
        Tcp::socket socket(client_io_);
        socket.connect({asio::ip::make_address("127.0.0.1"), port_});
        return socket;
    }

    /// A client that trusts `anchor` alone and wants to speak to `name`.
    std::unique_ptr<Stream> connect_trusting(const fs::path& anchor, const std::string& name, error_code& error) {
        asio::ssl::context context(asio::ssl::context::tls_client);
        context.load_verify_file(anchor.string());
        auto stream = std::make_unique<Stream>(connect(), context);
        stream->set_verify_mode(asio::ssl::verify_peer);
        stream->set_verify_callback(asio::ssl::host_name_verification(name));
        stream->handshake(asio::ssl::stream_base::client, error);
        return stream;
    }
    std::unique_ptr<Stream> connect_safely() {
        error_code error;
        auto stream = connect_trusting(files_.certificate, "localhost", error);
        EXPECT_FALSE(error) << error.message();
        return stream;
    }
    static std::string read_all(Stream& stream) {
        error_code error;
        std::string answer;
        asio::read(stream, asio::dynamic_buffer(answer), error);
        EXPECT_EQ(error, asio::error::eof) << "the end of an answer must be told: " << error.message();
        return answer;
    }
    std::string get_safely(const std::string& target, const std::string& headers) {
        const auto stream = connect_safely();
        asio::write(*stream, asio::buffer("GET " + target + " HTTP/1.1\r\n" + headers + "Connection: close\r\n\r\n"));
        return read_all(*stream);
    }
    std::string get_safely(const std::string& target) {
        return get_safely(target, "Host: " + host() + "\r\n" + with_token());
    }
    /// What `openssl s_client` with these options makes of one request.
    ShellEnd ask_by_openssl(const std::string& options) const {
        return shell(
            fmt::format("printf 'GET /api/v1/status HTTP/1.1\\r\\nHost: {}\\r\\n{}Connection: close\\r\\n\\r\\n' "
                        "| timeout 20 openssl s_client -connect 127.0.0.1:{} -ign_eof -verify_return_error {}",
                        host(), "Authorization: Bearer " + token_ + "\\r\\n", port_, options));
    }
    std::string metrics() { return metrics_.text(*service_); }

    TlsFiles files_;
    asio::io_context client_io_;
};

TEST_F(TlsTest, AnswersWhoVerifiesItAndHasTheToken) {
    serve();
    const std::string port = ":" + std::to_string(port_);
    EXPECT_THAT(get_safely("/api/v1/status"), StartsWith("HTTP/1.1 200"));
    for (const char* name : {"localhost", "127.0.0.1", "rig.lab.example", "RIG.lab.example", "[::1]"})
        EXPECT_THAT(get_safely("/api/v1/status",
                               "Host: " + (name + port) + "\r\nOrigin: https://" + name + port + "\r\n" + with_token()),
                    StartsWith("HTTP/1.1 200"))
            << name;
    EXPECT_THAT(metrics(), HasSubstr("darkbox_tls_certificate_expires_seconds "));
}

TEST_F(TlsTest, TurnsAwayEverybodyElse) {
    serve();
    const std::string ours = "Host: " + host() + "\r\n";
    const std::string port = ":" + std::to_string(port_);
    const std::vector<std::pair<std::string, const char*>> table{
        {ours, "401"},  // no token
        {ours + "Authorization: Bearer " + std::string(64, 'b') + "\r\n", "401"},
        {"Host: evil.example" + port + "\r\n" + with_token(), "421"},     // DNS rebinding
        {"Host: lab.example" + port + "\r\n" + with_token(), "421"},      // a wildcard is one part, not none
        {"Host: a.b.lab.example" + port + "\r\n" + with_token(), "421"},  // and not two
        {"Host: .lab.example" + port + "\r\n" + with_token(), "421"},
        {"Host: rig.lab.example\r\n" + with_token(), "421"},                 // another port
        {ours + "Origin: http://" + host() + "\r\n" + with_token(), "403"},  // a page that came without TLS
        {ours + "Origin: https://evil.example\r\n" + with_token(), "403"},
    };
    for (const auto& [headers, status] : table)
        EXPECT_THAT(get_safely("/api/v1/status", headers), StartsWith(std::string("HTTP/1.1 ") + status)) << headers;
}

TEST_F(TlsTest, IsKnownByItsCertificateOnly) {
    serve();
    error_code error;
    connect_trusting(make_certificate(folder_.path(), "other").certificate, "localhost", error);
    EXPECT_THAT(error.message(), HasSubstr("certificate verify failed"));
    connect_trusting(files_.certificate, "evil.example", error);
    EXPECT_THAT(error.message(), HasSubstr("certificate verify failed"));
    EXPECT_THAT(get_safely("/api/v1/status"), StartsWith("HTTP/1.1 200"));
}

TEST_F(TlsTest, SpeaksWithOpenssl) {
    serve();
    const std::string trusting = "-CAfile " + files_.certificate.string() + " -verify_hostname localhost ";
    for (const char* version : {"-tls1_2", "-tls1_3"}) {
        const ShellEnd end = ask_by_openssl(trusting + version);
        EXPECT_THAT(end.out, HasSubstr("HTTP/1.1 200 OK")) << version;
        EXPECT_THAT(end.out, HasSubstr("Verify return code: 0 (ok)")) << version;
    }
    for (const char* old : {"-tls1 -cipher ALL:@SECLEVEL=0", "-tls1_1 -cipher ALL:@SECLEVEL=0",
                            "-tls1_2 -cipher AES128-SHA:AES256-GCM-SHA384"}) {
        const ShellEnd end = ask_by_openssl(trusting + old);
        EXPECT_NE(end.status, 0) << old;
        EXPECT_THAT(end.out, Not(HasSubstr("HTTP/1.1"))) << old;
        EXPECT_THAT(end.out, HasSubstr("alert")) << old;  // the daemon's refusal, not openssl's own
    }
    EXPECT_THAT(get_safely("/api/v1/status"), StartsWith("HTTP/1.1 200"));
}

TEST_F(TlsTest, HearsNothingThatIsNotTls) {
    serve();
    EXPECT_THAT(get("/api/v1/status"), Not(HasSubstr("HTTP/1.1")));
    EXPECT_THAT(exchange("POST /api/v1/captures HTTP/1.1\r\nHost: " + host() + "\r\n" + with_token() +
                         "Content-Type: application/json\r\nContent-Length: 2\r\n\r\n{}"),
                Not(HasSubstr("HTTP/1.1")));
    EXPECT_THAT(metrics(), HasSubstr("darkbox_http_refused_total 2\n"));
    EXPECT_TRUE(answers());
}

TEST_F(TlsTest, DoesNotWaitForSlowHandshakes) {
    using Clock = std::chrono::steady_clock;
    options_.deadline = std::chrono::milliseconds(1500);
    serve();
    std::vector<Tcp::socket> slow;
    for (int i = 0; i < 20; ++i) {
        slow.push_back(connect());
        if (i % 2 == 0) asio::write(slow.back(), asio::buffer(std::string("\x16\x03\x01\x02\x00\x01", 6)));
    }
    const auto begun = Clock::now();
    EXPECT_THAT(get_safely("/api/v1/status"), StartsWith("HTTP/1.1 200"));
    EXPECT_TRUE(answers());
    EXPECT_LT(Clock::now() - begun, options_.deadline);
    for (Tcp::socket& socket : slow) {
        error_code error;
        char byte = 0;
        asio::read(socket, asio::buffer(&byte, 1), error);
        EXPECT_TRUE(error == asio::error::eof || error == asio::error::connection_reset) << error.message();
    }
    EXPECT_LT(Clock::now() - begun, 4 * options_.deadline);
}

TEST_F(TlsTest, StrangersDoNotFillTheCommandLinesDoor) {
    options_.max_connections = 4;
    serve();
    std::vector<Tcp::socket> silent;
    for (int i = 0; i < 12; ++i) silent.push_back(connect());
    EXPECT_TRUE(eventually([this] { return metrics().find("darkbox_http_refused_total 8\n") != std::string::npos; }));
    EXPECT_TRUE(answers());
}

TEST_F(TlsTest, ShakesNoMoreHandsThanItsRate) {
    options_.handshakes_per_second = 0.001;
    options_.handshakes_at_once = 3;
    serve();
    for (int i = 0; i < 3; ++i) EXPECT_THAT(get_safely("/api/v1/status"), StartsWith("HTTP/1.1 200"));
    error_code error;
    connect_trusting(files_.certificate, "localhost", error);
    EXPECT_TRUE(error);
    EXPECT_TRUE(answers());
}

TEST_F(TlsTest, TellsEventsThroughAWebSocket) {
    options_.heartbeat = std::chrono::milliseconds(200);
    serve();
    const auto stream = connect_safely();
    asio::write(*stream, asio::buffer("GET /api/v1/events?after=0 HTTP/1.1\r\nHost: " + host() +
                                      "\r\nOrigin: https://" + host() +
                                      "\r\nConnection: Upgrade\r\nUpgrade: websocket\r\nSec-WebSocket-Version: 13\r\n"
                                      "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n"
                                      "Sec-WebSocket-Protocol: darkbox.v1, darkbox.token." +
                                      token_ + "\r\n\r\n"));
    std::string answer;
    asio::read_until(*stream, asio::dynamic_buffer(answer), "\"event\":\"state\"");
    EXPECT_THAT(answer, StartsWith("HTTP/1.1 101"));
    EXPECT_THAT(answer, HasSubstr("s3pPLMBiTxaQ9kYGzzhZRbK+xOo="));
    service_->request_stop();  // ends the socket in order: by its own word, so that a truncated stream would be seen
    error_code error;
    asio::read(*stream, asio::dynamic_buffer(answer), error);
    EXPECT_THAT(answer, HasSubstr(std::string("\x88\x02\x03\xe9", 4)));  // close, going away
}

TEST_F(TlsTest, SendsLargeFilesWhole) {
    std::string bytes(3 << 20, '\0');
    std::mt19937 random(5);
    for (char& byte : bytes) byte = static_cast<char>(random());
    std::ofstream(sessions_ / "cup" / "data" / "frames" / "b.tif", std::ios::binary) << bytes;
    serve();
    EXPECT_TRUE(body_of(get_safely("/api/v1/sessions/cup/files/data/frames/b.tif")) == bytes);
}

TEST_F(TlsTest, SurvivesDamagedHandshakes) {
    options_.deadline = std::chrono::milliseconds(50);
    options_.handshakes_per_second = 1e9;
    options_.handshakes_at_once = 1e9;
    serve();
    // The first flight of a real client, caught by one who only listens.
    asio::ssl::context context(asio::ssl::context::tls_client);
    Tcp::acceptor trap(client_io_, {asio::ip::make_address("127.0.0.1"), 0});
    std::string hello(4096, '\0');
    {
        std::jthread client([&, port = trap.local_endpoint().port()] {
            asio::io_context io;
            Stream stream(io, context);
            stream.next_layer().connect({asio::ip::make_address("127.0.0.1"), port});
            error_code error;
            stream.handshake(asio::ssl::stream_base::client, error);
        });
        Tcp::socket caught = trap.accept();
        hello.resize(caught.read_some(asio::buffer(hello)));
    }
    ASSERT_GT(hello.size(), 100u);
    std::mt19937 random(13);
    for (int i = 0; i < 200; ++i) {
        std::string bytes = hello;
        for (unsigned n = 0; n <= random() % 6; ++n) bytes[random() % bytes.size()] = static_cast<char>(random());
        if (i % 3 == 0) bytes.resize(random() % bytes.size());
        EXPECT_THAT(exchange(bytes), Not(HasSubstr("HTTP/1.1"))) << i;
    }
    EXPECT_TRUE(answers());
    options_.deadline = std::chrono::milliseconds(2000);
}

TEST_F(TlsTest, ListensForOtherMachinesByTlsOnly) {
    options_.tcp->address = "0.0.0.0";
    serve();
    EXPECT_THAT(get_safely("/api/v1/status", "Host: rig.lab.example:" + std::to_string(port_) + "\r\n" + with_token()),
                StartsWith("HTTP/1.1 200"));
    options_.tcp->tls.reset();
    options_.socket = folder_.path() / "other.sock";
    asio::io_context io;
    EXPECT_THROW(HttpServer(io, options_, {}, log_, metrics_), InputError);
}

TEST_F(TlsTest, StopsWhileSomebodyShakesHands) {
    serve();
    const Tcp::socket silent = connect();
    ASSERT_TRUE(eventually([this] { return metrics().find("darkbox_http_connections 1\n") != std::string::npos; }));
    const auto begun = std::chrono::steady_clock::now();
    asio::post(io_, [this] { server_->stop(); });
    loop_.join();
    EXPECT_LT(std::chrono::steady_clock::now() - begun, std::chrono::seconds(1));
    loop_ = std::jthread([] {});
}

// The files.

class IdentityTest : public testing::Test {
protected:
    /// What is said of the files, and that a remedy is.
    std::string complaint(const TlsFiles& files, system_clock::time_point now = system_clock::now()) const {
        try {
            load_identity(files, now);
        } catch (const InputError& error) {
            EXPECT_NE(std::string(error.hint()), "");
            return error.what();
        }
        return "no error";
    }

    TemporaryFolder folder_;
};

TEST_F(IdentityTest, TellsWhoItIsFor) {
    const auto before = system_clock::now();
    const TlsIdentity identity = load_identity(make_certificate(folder_.path(), "rig"), before + std::chrono::hours(1));
    EXPECT_THAT(identity.names, testing::ElementsAre("localhost", "*.lab.example", "127.0.0.1", "::1"));
    EXPECT_GT(identity.expires, before + std::chrono::hours(29 * 24));
    EXPECT_LT(identity.expires, before + std::chrono::hours(31 * 24));
}

TEST_F(IdentityTest, SaysWhatIsWrongWithItsFiles) {
    const TlsFiles good = make_certificate(folder_.path(), "rig");
    const TlsFiles other = make_certificate(folder_.path(), "other");
    const auto now = system_clock::now();
    EXPECT_THAT(complaint(good, now + std::chrono::hours(31 * 24)), HasSubstr("has expired"));
    EXPECT_THAT(complaint(good, now - std::chrono::hours(24)), HasSubstr("is valid only from"));
    EXPECT_THAT(complaint({good.certificate, other.key}), HasSubstr("does not belong to"));
    EXPECT_THAT(complaint({folder_.path() / "none", good.key}), HasSubstr("No such file"));
    EXPECT_THAT(complaint({good.certificate, folder_.path() / "none"}), HasSubstr("No such file"));
    EXPECT_THAT(complaint({folder_.path(), good.key}), HasSubstr("Is a directory"));
    EXPECT_THAT(complaint({good.key, good.key}), HasSubstr("holds no certificate"));
    EXPECT_THAT(complaint({good.certificate, good.certificate}), HasSubstr("holds no key"));
    const fs::path locked = folder_.path() / "locked.key";
    run(fmt::format("umask 077; openssl pkey -aes256 -passout pass:x -in {} -out {}", good.key.string(),
                    locked.string()));
    EXPECT_THAT(complaint({good.certificate, locked}), HasSubstr("is encrypted"));
    EXPECT_THAT(complaint(make_certificate(folder_.path(), "nameless", "")), HasSubstr("is for no host"));
    std::ofstream(folder_.path() / "empty") << "";
    fs::permissions(folder_.path() / "empty", fs::perms::owner_read);
    EXPECT_THAT(complaint({folder_.path() / "empty", good.key}), HasSubstr("holds no certificate"));
    EXPECT_THAT(complaint({good.certificate, folder_.path() / "empty"}), HasSubstr("holds no key"));
    ::chmod(good.key.c_str(), 0640);
    EXPECT_EQ(complaint(good), "no error");
    ::chmod(good.key.c_str(), 0644);
    EXPECT_THAT(complaint(good), HasSubstr("may be read by others"));
}

TEST_F(IdentityTest, FollowsARenewalAndKeepsWhatIsGood) {
    const auto now = system_clock::now();
    const TlsFiles files = make_certificate(folder_.path(), "rig");
    RenewedIdentity identity(files, now);
    const auto context = identity.get().context;
    identity.look(now + std::chrono::minutes(1));
    EXPECT_EQ(identity.get().context, context);

    std::ofstream(files.certificate) << "not a certificate";
    fs::last_write_time(files.certificate, fs::file_time_type::clock::now() + std::chrono::seconds(10));
    EXPECT_THROW(identity.look(now + std::chrono::minutes(2)), InputError);
    EXPECT_NO_THROW(identity.look(now + std::chrono::minutes(3)));  // told once
    EXPECT_EQ(identity.get().context, context);

    make_certificate(folder_.path(), "rig", "DNS:other.example");
    fs::last_write_time(files.certificate, fs::file_time_type::clock::now() + std::chrono::seconds(20));
    identity.look(now + std::chrono::minutes(3) + std::chrono::seconds(1));  // too early to look again
    EXPECT_EQ(identity.get().context, context);
    identity.look(now + std::chrono::minutes(4));
    EXPECT_NE(identity.get().context, context);
    EXPECT_THAT(identity.get().names, testing::ElementsAre("other.example"));
}

}  // namespace
}  // namespace darkbox
