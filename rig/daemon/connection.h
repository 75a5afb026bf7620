#pragma once

#include <functional>
#include <memory>
#include <set>
#include <utility>

#include "rig/daemon/http_server.h"
#include "rig/daemon/tls_stream.h"

namespace darkbox {

using boost::system::error_code;
template <typename T = void>
using Task = asio::awaitable<T>;

inline auto into(error_code& error) { return asio::redirect_error(asio::use_awaitable, error); }

/// What the connections share. They hold it themselves: a connection may outlive the server object by a moment.
struct HttpServer::Shared {
    asio::io_context& io;
    const HttpServerOptions options;
    const Handler handler;
    EventLog& log;
    Metrics& metrics;
    asio::ip::tcp::endpoint bound = {};  ///< what is listened on, by TCP
    std::optional<TcpAccess> tcp = {};
    RateLimit rate;
    RateLimit handshakes;
    std::optional<RenewedIdentity> identity = {};  ///< what TLS shows
    asio::thread_pool worker{4};  ///< runs the handler; several, so that a slow request does not hold up lamps/dark
    bool stopping = false;
    std::size_t local_connections = 0;  ///< by the Unix socket
    std::size_t tcp_connections = 0;
    std::set<std::function<void()>*> reading = {};  ///< what cancels those that wait for a request
    std::set<asio::steady_timer*> listening = {};   ///< waiting for an event
};

/// Keeps `item` in `set` for the length of a scope.
template <typename T>
class Listed {
public:
    Listed(std::set<T*>& set, T& item) : set_(set), item_(&item) { set_.insert(item_); }
    Listed(const Listed&) = delete;
    Listed& operator=(const Listed&) = delete;
    ~Listed() { set_.erase(item_); }

private:
    std::set<T*>& set_;
    T* item_;
};

/// Waits for events after `number`, or for the moment of a heartbeat; empty then, and when the log is closed.
Task<std::vector<Event>> next_events(HttpServer::Shared& shared, std::uint64_t& number);

/// Runs a job on the worker's thread, and comes back.
template <typename Work>
Task<std::invoke_result_t<Work>> on_worker(HttpServer::Shared& shared, Work work) {
    co_return co_await asio::co_spawn(
        shared.worker, [work = std::move(work)]() -> Task<std::invoke_result_t<Work>> { co_return work(); },
        asio::use_awaitable);
}

/// The life of one connection, on any kind of socket.
Task<> serve(std::shared_ptr<HttpServer::Shared> shared, UnixStream stream);
Task<> serve(std::shared_ptr<HttpServer::Shared> shared, TcpStream stream);
Task<> serve(std::shared_ptr<HttpServer::Shared> shared, TlsStream stream);

/// Events through a WebSocket, until either side ends it. What the client says is answered by hanging up.
Task<> serve_websocket(HttpServer::Shared& shared, UnixStream& stream, const http::request<http::string_body>& request,
                       std::uint64_t after);
Task<> serve_websocket(HttpServer::Shared& shared, TcpStream& stream, const http::request<http::string_body>& request,
                       std::uint64_t after);
Task<> serve_websocket(HttpServer::Shared& shared, TlsStream& stream, const http::request<http::string_body>& request,
                       std::uint64_t after);

}  // namespace darkbox
