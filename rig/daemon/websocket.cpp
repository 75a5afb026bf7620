#include "rig/daemon/connection.h"

// After asio.h, which makes Boost 1.74 compile.
#include <boost/beast/websocket/ssl.hpp>
#include <boost/beast/websocket/stream.hpp>

namespace darkbox {
namespace {

namespace websocket = beast::websocket;
using Shared = HttpServer::Shared;
using Request = http::request<http::string_body>;

constexpr std::size_t longest_message = 1024;  ///< bytes, of what a client may say before it is cut off
constexpr std::string_view protocol = "darkbox.v1";

/// Whether the client offers the protocol; a browser that offers any wants one of them chosen.
bool offers_protocol(const Request& request) {
    const auto offered = request[http::field::sec_websocket_protocol];
    return std::string_view(offered.data(), offered.size()).find(protocol) != std::string_view::npos;
}

/// Answers pings and closes, which reading does; a message is not expected and ends it.
template <typename Socket>
Task<> listen_to(Socket& socket, asio::steady_timer& ended) {
    beast::flat_buffer buffer(longest_message);
    error_code error;
    co_await socket.async_read(buffer, into(error));
    if (!error) co_await socket.async_close(websocket::close_code::policy_error, into(error));
    ended.cancel();
}

/// Ends when the socket does, or the log.
template <typename Socket>
Task<> tell(Shared& shared, Socket& socket, std::uint64_t number) {
    error_code error;
    while (!error && socket.is_open()) {
        const std::vector<Event> events = co_await next_events(shared, number);
        if (events.empty() && shared.log.closed()) {
            co_await socket.async_close(websocket::close_code::going_away, into(error));
            co_return;
        }
        for (const Event& event : events) {
            if (!error && socket.is_open()) co_await socket.async_write(asio::buffer(event.json), into(error));
        }
    }
}

template <typename Stream>
Task<> run(Shared& shared, Stream& stream, const Request& request, std::uint64_t after) {
    beast::get_lowest_layer(stream).expires_never();  // the WebSocket has deadlines of its own
    websocket::stream<Stream&> socket(stream);
    websocket::stream_base::timeout limits{};
    limits.handshake_timeout = shared.options.deadline;
    limits.idle_timeout = 2 * shared.options.heartbeat;
    limits.keep_alive_pings = true;
    socket.set_option(limits);
    socket.read_message_max(longest_message);
    socket.text(true);
    if (offers_protocol(request))
        socket.set_option(websocket::stream_base::decorator([](websocket::response_type& response) {
            response.set(http::field::sec_websocket_protocol, beast::string_view(protocol.data(), protocol.size()));
        }));
    error_code error;
    co_await socket.async_accept(request, into(error));
    if (error) co_return;

    asio::steady_timer reader_ended(shared.io, asio::steady_timer::time_point::max());
    bool reading = true;
    asio::co_spawn(
        shared.io, [&]() -> Task<> { return listen_to(socket, reader_ended); },
        [&](const std::exception_ptr&) {
            reading = false;
            reader_ended.cancel();
        });
    co_await tell(shared, socket, after);
    if (reading) {
        // What the reader waits for ends with the socket under it; it uses what lives here.
        beast::get_lowest_layer(socket).cancel();
        beast::get_lowest_layer(socket).close();
        while (reading) co_await reader_ended.async_wait(into(error));
    }
}

}  // namespace

Task<> serve_websocket(Shared& shared, UnixStream& stream, const Request& request, std::uint64_t after) {
    co_await run(shared, stream, request, after);
}
Task<> serve_websocket(Shared& shared, TcpStream& stream, const Request& request, std::uint64_t after) {
    co_await run(shared, stream, request, after);
}
Task<> serve_websocket(Shared& shared, TlsStream& stream, const Request& request, std::uint64_t after) {
    co_await run(shared, stream, request, after);
}

}  // namespace darkbox
