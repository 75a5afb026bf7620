#include "rig/daemon/http_server.h"

#include <fmt/format.h>

#include "acquisition/device/device_error.h"
#include "rig/daemon/attempt.h"
#include "rig/daemon/connection.h"

namespace darkbox {
namespace {

using Shared = HttpServer::Shared;
using Tcp = asio::ip::tcp;

void check(const error_code& error, const char* call, const std::string& where) {
    if (error) throw_errno(call, where, error.value());
}

void refuse_open(const asio::ip::address& address, const TcpListen& listen) {
    if (address.is_loopback() || listen.tls) return;
    throw InputError(fmt::format("{} is not a loopback address, and there is no certificate", address.to_string()),
                     "listen on 127.0.0.1 or ::1, or set [api] certificate and key: others come in by TLS only");
}

/// One that systemd opened.
Tcp::acceptor take_over(asio::io_context& io, const TcpListen& listen) {
    sockaddr_storage bound{};
    socklen_t size = sizeof bound;
    if (::getsockname(*listen.listening, reinterpret_cast<sockaddr*>(&bound), &size) != 0)
        throw_errno("getsockname", "of the socket that was handed over", errno);
    Tcp::acceptor acceptor(io, bound.ss_family == AF_INET6 ? Tcp::v6() : Tcp::v4(), *listen.listening);
    refuse_open(acceptor.local_endpoint().address(), listen);
    return acceptor;
}

Tcp::acceptor listen_on(asio::io_context& io, const TcpListen& listen) {
    error_code error;
    if (listen.listening) return take_over(io, listen);
    const auto address = asio::ip::make_address(listen.address, error);
    if (error)
        throw InputError(fmt::format("\"{}\" is not an address", listen.address),
                         "listen on 127.0.0.1 or ::1, or on another address of this machine with TLS");
    refuse_open(address, listen);
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
    if (error == asio::error::access_denied || error == error_code(EADDRNOTAVAIL, boost::system::system_category()))
        throw InputError(fmt::format("darkboxd may not listen on {}: {}", where, error.message()),
                         "choose an address of this machine, and a port from 1024 on");
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

/// The names are those of the address that is listened on, and of the certificate.
void learn_names(Shared& shared) {
    const auto names = shared.identity ? shared.identity->get().names : std::vector<std::string>();
    shared.tcp->hosts = own_hosts(shared.bound.address().to_string(), shared.bound.port(), names);
    if (shared.identity) shared.metrics.certificate_expires(shared.identity->get().expires);
}

/// What the certificate's files say now; a bad renewal leaves the old one in use, and is told.
asio::ssl::context& current_identity(Shared& shared) {
    const auto failure = attempt([&] { shared.identity->look(RenewedIdentity::Clock::now()); });
    if (failure) shared.log.publish("problem", {{"detail", failure->what}, {"hint", failure->hint}});
    learn_names(shared);
    return *shared.identity->get().context;
}

void serve_new(const std::shared_ptr<Shared>& shared, UnixProtocol::socket socket) {
    asio::co_spawn(shared->io, serve(shared, UnixStream(std::move(socket))), asio::detached);
}
void serve_new(const std::shared_ptr<Shared>& shared, Tcp::socket socket) {
    error_code ignored;
    socket.set_option(Tcp::no_delay(true), ignored);
    if (!shared->identity) {
        asio::co_spawn(shared->io, serve(shared, TcpStream(std::move(socket))), asio::detached);
        return;
    }
    // Who is one too many is not worth a handshake to be told so.
    const bool room = shared->tcp_connections < shared->options.max_connections;
    if (!room || !shared->handshakes.take(RateLimit::Clock::now())) {
        shared->metrics.refused();
        return;
    }
    asio::ssl::context& context = current_identity(*shared);
    asio::co_spawn(shared->io, serve(shared, TlsStream(TcpStream(std::move(socket)), context)), asio::detached);
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
            serve_new(shared, std::move(socket));
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
    : file_(options.listening ? SocketFile(io, *options.listening)
                              : SocketFile(io, options.socket, options.peers.group)),
      shared_(new Shared{.io = io,
                         .options = options,
                         .handler = std::move(handler),
                         .log = log,
                         .metrics = metrics,
                         .rate = RateLimit(options.requests_per_second, options.requests_at_once),
                         .handshakes = RateLimit(options.handshakes_per_second, options.handshakes_at_once)}) {
    if (options.tcp) {  // first what may throw: what is spawned below outlives a failed constructor
        if (options.tcp->tls) shared_->identity.emplace(*options.tcp->tls);
        tcp_.emplace(listen_on(io, *options.tcp));
        shared_->bound = tcp_->local_endpoint();
        shared_->tcp = TcpAccess{.token = options.tcp->token, .hosts = {}, .tls = options.tcp->tls.has_value()};
        learn_names(*shared_);
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

std::string HttpServer::address() const { return tcp_ ? tcp_->local_endpoint().address().to_string() : ""; }

unsigned short HttpServer::port() const { return tcp_ ? tcp_->local_endpoint().port() : 0; }

void HttpServer::stop() {
    shared_->stopping = true;
    error_code ignored;
    file_.acceptor().close(ignored);
    if (tcp_) tcp_->close(ignored);
    for (std::function<void()>* cancel : shared_->reading) (*cancel)();
}

}  // namespace darkbox
