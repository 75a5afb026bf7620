#include "rig/daemon/client.h"

#include <fmt/format.h>
#include <unistd.h>

#include <cstdlib>

#include "acquisition/device/device_error.h"
#include "rig/daemon/asio.h"

namespace darkbox {
namespace {

namespace fs = std::filesystem;
using boost::system::error_code;
using Json = nlohmann::json;
using Request = http::request<http::string_body>;
using ResponseParser = http::response_parser<http::string_body>;

constexpr auto idle_every = std::chrono::milliseconds(100);
constexpr auto longest_silence = std::chrono::seconds(60);  ///< the daemon's heartbeat comes every 15 s
constexpr std::uint64_t longest_answer = 64 * 1024 * 1024;  ///< bytes

/// One connection. Blocking calls are asynchronous ones waited for: only those can have a deadline.
class Connection {
public:
    Connection(const fs::path& socket, std::chrono::milliseconds deadline) : socket_(socket), stream_(io_) {
        stream_.expires_after(deadline);
        stream_.async_connect(UnixProtocol::endpoint(socket.string()), [this](error_code error) { end_ = error; });
        wait("connect");
    }

    void send(const Request& request) {
        http::async_write(stream_, request, [this](error_code error, std::size_t) { end_ = error; });
        wait("write");
    }

    void receive(ResponseParser& parser) {
        http::async_read(stream_, buffer_, parser, [this](error_code error, std::size_t) { end_ = error; });
        wait("read");
    }

    /// Some more of the answer; `idle` is called while it does not come.
    void receive_some(ResponseParser& parser, const std::function<void()>& idle) {
        stream_.expires_after(longest_silence);
        end_.reset();
        http::async_read_some(stream_, buffer_, parser, [this](error_code error, std::size_t) { end_ = error; });
        io_.restart();
        while (!end_) {
            io_.run_for(idle_every);
            idle();
        }
        fail_on_error("read");
    }

private:
    void wait(const char* call) {
        end_.reset();
        io_.restart();
        io_.run();
        fail_on_error(call);
    }

    void fail_on_error(const char* call) const {
        if (!*end_) return;
        const std::string reason = *end_ == beast::error::timeout ? "no answer in time" : end_->message();
        throw DeviceError(fmt::format("darkboxd at {}: {}: {}", socket_.string(), call, reason),
                          "see whether darkboxd still runs: darkbox rig status");
    }

    fs::path socket_;
    asio::io_context io_;
    UnixStream stream_;
    beast::flat_buffer buffer_;
    std::optional<error_code> end_;  ///< of the operation under way
};

Request make_request(const std::string& method, const std::string& target, const Json& body) {
    Request request;
    request.method_string(method);
    request.target("/api/v1/" + target);
    request.version(11);
    request.set(http::field::host, "darkbox");
    request.keep_alive(false);
    if (!body.is_null()) {
        request.set(http::field::content_type, "application/json");
        request.body() = body.dump(-1, ' ', false, Json::error_handler_t::replace);
    }
    request.prepare_payload();
    return request;
}

Json parse(const std::string& text) {
    Json json = Json::parse(text, nullptr, /*allow_exceptions=*/false);
    if (json.is_discarded() || !json.is_object())
        throw DeviceError("darkboxd's answer is not a JSON object", "is it another program's socket?");
    return json;
}

[[noreturn]] void throw_problem(const Json& body) {
    throw InputError(body.value("detail", std::string("darkboxd refused the request")),
                     body.value("hint", std::string()));
}

/// Takes the first whole line off the text; no value when there is none.
std::optional<std::string> take_line(std::string& text) {
    const auto end = text.find('\n');
    if (end == text.npos) return std::nullopt;
    std::string line = text.substr(0, end);
    text.erase(0, end + 1);
    return line;
}

}  // namespace

DaemonClient::DaemonClient(fs::path socket, std::chrono::milliseconds deadline)
    : socket_(std::move(socket)), deadline_(deadline) {}

bool DaemonClient::answers() const {
    asio::io_context io;
    UnixProtocol::socket probe(io);
    error_code error;
    if (socket_.string().size() < sizeof(sockaddr_un::sun_path))
        probe.connect(UnixProtocol::endpoint(socket_.string()), error);
    return probe.is_open() && !error;
}

DaemonClient::Reply DaemonClient::request(const std::string& method, const std::string& target,
                                          const Json& body) const {
    Connection connection(socket_, deadline_);
    connection.send(make_request(method, target, body));
    ResponseParser parser;
    parser.body_limit(longest_answer);
    connection.receive(parser);
    return {static_cast<int>(parser.get().result_int()), parse(parser.get().body())};
}

Json DaemonClient::call(const std::string& method, const std::string& target, const Json& body) const {
    Reply reply = request(method, target, body);
    if (reply.status >= 400) throw_problem(reply.body);
    return std::move(reply.body);
}

void DaemonClient::follow_events(std::uint64_t after, const Listener& listener) const {
    Connection connection(socket_, deadline_);
    connection.send(make_request("GET", fmt::format("events?after={}", after), nullptr));
    ResponseParser parser;
    parser.body_limit(boost::none);
    while (!parser.is_done()) {
        connection.receive_some(parser, listener.idle);
        if (!parser.is_header_done()) continue;
        std::string& text = parser.get().body();
        if (parser.get().result_int() >= 400) {
            if (parser.is_done()) throw_problem(parse(text));
            continue;
        }
        while (const auto line = take_line(text))
            if (!line->empty() && listener.event(parse(*line)) == Follow::leave) return;
    }
}

std::optional<fs::path> known_socket() {
    const auto from = [](const char* variable) -> std::string {
        const char* value = std::getenv(variable);
        return value == nullptr ? "" : value;
    };
    if (const std::string given = from("DARKBOX_SOCKET"); !given.empty()) return given;
    if (const std::string folder = from("XDG_RUNTIME_DIR"); !folder.empty()) return fs::path(folder) / "darkbox.sock";
    if (::geteuid() == 0) return "/run/darkbox/darkbox.sock";
    return std::nullopt;
}

fs::path default_socket() {
    if (auto socket = known_socket()) return std::move(*socket);
    throw InputError("no place for darkboxd's socket is known", "set DARKBOX_SOCKET, or give --socket PATH");
}

}  // namespace darkbox
