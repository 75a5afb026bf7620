#include "rig/daemon/http_server.h"

#include <fmt/format.h>

#include "acquisition/device/device_error.h"
#include "rig/daemon/connection.h"

namespace darkbox {
namespace {

using Shared = HttpServer::Shared;
using Tcp = asio::ip::tcp;

void check(const error_code& error, const char* call, const std::string& where) {
    if (error) throw_errno(call, where, error.value());
}

Tcp::acceptor listen_on(asio::io_context& io, const TcpListen& listen) {
    error_code error;
    const auto address = asio::ip::make_address(listen.address, error);
    if (error || !address.is_loopback())
        throw InputError(fmt::format("{} is not a loopback address", listen.address),
                         "listen on 127.0.0.1 or ::1; for other machines put a server with TLS in front of it");
    const std::string where = fmt::format("{}:{}", listen.address, listen.port);
    Tcp::acceptor acceptor(io);
    const Tcp::endpoint endpoint(address, listen.port);
    acceptor.open(endpoint.protocol(), error);
    check(error, "socket", where);
    acceptor.set_option(Tcp::acceptor::reuse_address(true), error);
    check(error, "setsockopt", where);
    acceptor.bind(endpoint, error);
    if (error == asio::error::address_in_use)
        throw InputError(fmt::format("{} is taken by another program", where), "choose another port");
    check(error, "bind", where);
    acceptor.listen(asio::socket_base::max_listen_connections, error);
    check(error, "listen", where);
    return acceptor;
}

/// A connection by this socket may be served.
bool welcome(Shared& shared, UnixProtocol::socket& socket) {
    ucred peer{};
    socklen_t size = sizeof peer;
    return ::getsockopt(socket.native_handle(), SOL_SOCKET, SO_PEERCRED, &peer, &size) == 0 &&
           may_connect(shared.options.peers, peer.uid, peer.gid);
}
bool welcome(Shared&, Tcp::socket&) { return true; }

UnixStream stream_of(UnixProtocol::socket socket) { return UnixStream(std::move(socket)); }
TcpStream stream_of(Tcp::socket socket) {
    error_code ignored;
    socket.set_option(Tcp::no_delay(true), ignored);
    return TcpStream(std::move(socket));
}

template <typename Acceptor>
Task<> accept_all(std::shared_ptr<Shared> shared, Acceptor& acceptor) {
    while (!shared->stopping) {
        error_code error;
        auto socket = co_await acceptor.async_accept(into(error));
        if (shared->stopping || error == asio::error::operation_aborted) co_return;
        if (!error && !welcome(*shared, socket)) {
            shared->metrics.refused();
        } else if (!error) {
            asio::co_spawn(shared->io, serve(shared, stream_of(std::move(socket))), asio::detached);
        } else {
            // Out of file descriptors, most likely: some come free in a moment.
            asio::steady_timer pause(shared->io, std::chrono::milliseconds(100));
            co_await pause.async_wait(into(error));
        }
    }
}

void wake_listeners(Shared& shared) {
    for (asio::steady_timer* timer : shared.listening) timer->cancel();
}

}  // namespace

HttpServer::HttpServer(asio::io_context& io, const HttpServerOptions& options, Handler handler, EventLog& log,
                       Metrics& metrics)
    : file_(io, options.socket, options.peers.group),
      shared_(new Shared{.io = io,
                         .options = options,
                         .handler = std::move(handler),
                         .log = log,
                         .metrics = metrics,
                         .rate = RateLimit(options.requests_per_second, options.requests_at_once)}) {
    if (options.tcp) {  // first what may throw: what is spawned below outlives a failed constructor
        tcp_.emplace(listen_on(io, *options.tcp));
        shared_->tcp = TcpAccess{options.tcp->token, own_hosts(options.tcp->address, port())};
    }
    log.on_change([shared = std::weak_ptr(shared_), &io] {
        asio::post(io, [shared] {
            if (const auto alive = shared.lock()) wake_listeners(*alive);
        });
    });
    asio::co_spawn(io, accept_all(shared_, file_.acceptor()), asio::detached);
    if (tcp_) asio::co_spawn(io, accept_all(shared_, *tcp_), asio::detached);
}

HttpServer::~HttpServer() {
    shared_->log.on_change({});
    stop();
    release_handler();
}

void HttpServer::release_handler() { shared_->worker.join(); }

unsigned short HttpServer::port() const { return tcp_ ? tcp_->local_endpoint().port() : 0; }

void HttpServer::stop() {
    shared_->stopping = true;
    error_code ignored;
    file_.acceptor().close(ignored);
    if (tcp_) tcp_->close(ignored);
    for (std::function<void()>* cancel : shared_->reading) (*cancel)();
}

}  // namespace darkbox
