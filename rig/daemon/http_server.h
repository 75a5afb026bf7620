#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "rig/daemon/access.h"
#include "rig/daemon/api.h"
#include "rig/daemon/events.h"
#include "rig/daemon/socket_file.h"
#include "rig/daemon/tls.h"

namespace darkbox {

/// An address to listen on besides the Unix socket.
struct TcpListen {
    std::string address = "127.0.0.1";  ///< loopback; with `tls` any of this machine's, or 0.0.0.0 or ::
    unsigned short port = 0;            ///< 0: any free one
    std::string token = {};
    std::optional<TlsFiles> tls = {};
    std::optional<int> listening = {};  ///< a socket that somebody else opened; address and port are its own
};

struct HttpServerOptions {
    std::filesystem::path socket;
    std::optional<int> listening = {};      ///< a Unix socket that somebody else opened, instead
    PeerAccess peers = {};                  ///< who may use the Unix socket
    std::optional<TcpListen> tcp = {};      ///< none: no listener that a browser could reach
    std::uint32_t header_limit = 8 * 1024;  ///< bytes
    std::uint64_t body_limit = 64 * 1024;   ///< bytes
    std::size_t max_connections = 128;      ///< by each of the two sockets: strangers do not fill the command line's
    double requests_per_second = 200;       ///< by TCP, all connections together
    double requests_at_once = 400;
    double handshakes_per_second = 50;  ///< of TLS: each costs a signature
    double handshakes_at_once = 100;
    std::chrono::milliseconds deadline{10'000};   ///< for a handshake, one whole request, one piece of an answer
    std::chrono::milliseconds heartbeat{15'000};  ///< between lines of an event stream where nothing happens
};

/// HTTP/1.1 on a Unix socket and, where asked for, by TCP, plainly on loopback or by TLS: hands requests to `handler`
/// and streams events, by lines or through a WebSocket. Connections are served in io.run(), on one thread; the handler,
/// which must be thread-safe, runs on a few others, so that its work never delays an event. Thread-compatible, but for
/// what EventLog calls.
class HttpServer {
public:
    using Handler = std::function<ApiResponse(const ApiRequest&)>;

    /// Throws InputError for an address that is taken, or not loopback and without TLS, and for files of TLS that are
    /// no good; DeviceError when the system refuses.
    HttpServer(asio::io_context& io, const HttpServerOptions& options, Handler handler, EventLog& log,
               Metrics& metrics);
    HttpServer(const HttpServer&) = delete;
    HttpServer& operator=(const HttpServer&) = delete;
    ~HttpServer();

    /// The TCP address in use; empty without one.
    std::string address() const;
    /// The TCP port in use; 0 without one.
    unsigned short port() const;

    /// Takes no more connections and closes those that wait for a request. Event streams end by themselves once the
    /// event log is closed; then io.run() runs out of work.
    void stop();

    /// Waits for the handler's last answer, and calls it no more.
    void release_handler();

    struct Shared;

private:
    SocketFile file_;
    std::shared_ptr<Shared> shared_;
    std::optional<asio::ip::tcp::acceptor> tcp_;
};

}  // namespace darkbox
