#include "rig/daemon/connection.h"

#include <unistd.h>

#include <boost/beast/websocket/rfc6455.hpp>

namespace darkbox {
namespace {

using Shared = HttpServer::Shared;
using Request = http::request<http::string_body>;
using Response = http::response<http::string_body>;

constexpr std::size_t file_piece = 256 * 1024;  ///< bytes

/// What is begun on the stream from now on fails when it takes longer.
template <typename Stream>
void deadline_of(Stream& stream, std::chrono::milliseconds longest) {
    beast::get_lowest_layer(stream).expires_after(longest);
}

template <typename Fields>
void set_fields(Fields& fields, const ApiResponse& answer) {
    fields.set(http::field::server, "darkboxd");
    if (answer.status != 304) fields.set(http::field::content_type, answer.content_type);
    fields.set(http::field::cache_control, "no-store");
    fields.set("X-Content-Type-Options", "nosniff");
    if (!answer.allow.empty()) fields.set(http::field::allow, answer.allow);
    for (const auto& [name, value] : answer.headers) fields.set(name, value);
}

Response make_response(const ApiResponse& answer, bool keep_alive) {
    Response response(http::int_to_status(static_cast<unsigned>(answer.status)), 11);
    set_fields(response, answer);
    response.body() = answer.body;
    response.keep_alive(keep_alive);
    response.prepare_payload();
    return response;
}

ApiRequest to_api(const Request& request) {
    const auto text = [](auto view) { return std::string(view.data(), view.size()); };
    return {.method = text(request.method_string()),
            .target = text(request.target()),
            .content_type = text(request[http::field::content_type]),
            .range = text(request[http::field::range]),
            .if_range = text(request[http::field::if_range]),
            .if_none_match = text(request[http::field::if_none_match]),
            .body = request.body()};
}

Credentials credentials_of(const Request& request) {
    const auto text = [](auto view) { return std::string(view.data(), view.size()); };
    return {.host = text(request[http::field::host]),
            .origin = text(request[http::field::origin]),
            .authorization = text(request[http::field::authorization]),
            .protocols = text(request[http::field::sec_websocket_protocol])};
}

ApiResponse refusal(const error_code& error) {
    if (error == http::error::body_limit)
        return problem(413, "the request's body is too large", "64 KiB are plenty for any request");
    if (error == http::error::header_limit) return problem(431, "the request's header is too large", "send less");
    return problem(400, "this is not HTTP: " + error.message(), "speak HTTP/1.1");
}

/// By TCP, who asks must show that they may, and not ask too often.
template <typename Stream>
std::optional<ApiResponse> turned_away(Shared& shared, const Stream&, const Request& request) {
    if (!shared.rate.take(RateLimit::Clock::now())) {
        ApiResponse busy = problem(429, "too many requests", "ask less often");
        busy.headers.emplace_back("Retry-After", "1");
        return busy;
    }
    return refuse(*shared.tcp, credentials_of(request));
}
std::optional<ApiResponse> turned_away(Shared&, const UnixStream&, const Request&) { return std::nullopt; }

template <typename Stream>
Task<bool> send(Shared& shared, Stream& stream, const ApiResponse& answer, bool keep_alive) {
    const Response response = make_response(answer, keep_alive);
    error_code error;
    deadline_of(stream, shared.options.deadline);
    co_await http::async_write(stream, response, into(error));
    co_return !error && keep_alive;
}

/// Read on the worker's thread: a disk may take its time. Empty when the file ends early or does not read.
std::string read_piece(const FileSlice& file, std::uint64_t done) {
    std::string piece(std::min<std::uint64_t>(file_piece, file.length - done), '\0');
    const ssize_t got = ::pread(file.fd.get(), piece.data(), piece.size(), static_cast<off_t>(file.offset + done));
    piece.resize(got > 0 ? static_cast<std::size_t>(got) : 0);
    return piece;
}

template <typename Stream>
Task<bool> send_file(Shared& shared, Stream& stream, const ApiResponse& answer, bool keep_alive) {
    http::response<http::empty_body> head(http::int_to_status(static_cast<unsigned>(answer.status)), 11);
    set_fields(head, answer);
    head.content_length(answer.file->length);
    head.keep_alive(keep_alive);
    http::response_serializer<http::empty_body> serializer(head);
    error_code error;
    deadline_of(stream, shared.options.deadline);
    co_await http::async_write_header(stream, serializer, into(error));
    for (std::uint64_t done = 0; !error && done < answer.file->length;) {
        const std::string piece = co_await on_worker(shared, [&] { return read_piece(*answer.file, done); });
        if (piece.empty()) co_return false;  // the length was promised: all that is left is to hang up
        deadline_of(stream, shared.options.deadline);
        co_await asio::async_write(stream, asio::buffer(piece), into(error));
        done += piece.size();
    }
    co_return !error && keep_alive;
}

template <typename Stream>
Task<> stream_events(Shared& shared, Stream& stream, const ApiResponse& answer) {
    http::response<http::empty_body> head(http::status::ok, 11);
    set_fields(head, answer);
    head.chunked(true);
    head.keep_alive(false);
    http::response_serializer<http::empty_body> serializer(head);
    error_code error;
    deadline_of(stream, shared.options.deadline);
    co_await http::async_write_header(stream, serializer, into(error));
    std::uint64_t number = *answer.stream_events;
    while (!error) {
        const std::vector<Event> events = co_await next_events(shared, number);
        if (events.empty() && shared.log.closed()) break;
        std::string text = events.empty() ? "\n" : "";
        for (const Event& event : events) text += event.json + "\n";
        deadline_of(stream, shared.options.deadline);
        co_await asio::async_write(stream, http::make_chunk(asio::buffer(text)), into(error));
    }
    if (!error) co_await asio::async_write(stream, http::make_chunk_last(), into(error));
}

class Listening {
public:
    explicit Listening(Metrics& metrics) : metrics_(metrics) { metrics_.listener_joined(); }
    Listening(const Listening&) = delete;
    Listening& operator=(const Listening&) = delete;
    ~Listening() { metrics_.listener_left(); }

private:
    Metrics& metrics_;
};

/// The answer to one request that was read; whether the connection goes on.
template <typename Stream>
Task<bool> answer_one(Shared& shared, Stream& stream, const Request& request) {
    if (const auto refused = turned_away(shared, stream, request)) {
        shared.metrics.refused();
        co_return co_await send(shared, stream, *refused, false);
    }
    const bool keep_alive = request.keep_alive() && !shared.stopping;
    const ApiRequest asked = to_api(request);
    const ApiResponse answer = co_await on_worker(shared, [&] { return shared.handler(asked); });
    if (answer.file) co_return co_await send_file(shared, stream, answer, keep_alive);
    if (!answer.stream_events) co_return co_await send(shared, stream, answer, keep_alive);
    const Listening listening(shared.metrics);
    if (beast::websocket::is_upgrade(request))
        co_await serve_websocket(shared, stream, request, *answer.stream_events);
    else
        co_await stream_events(shared, stream, answer);
    co_return false;
}

/// One request and its answer; whether the connection goes on.
template <typename Stream>
Task<bool> serve_one(Shared& shared, Stream& stream, beast::flat_buffer& buffer) {
    http::request_parser<http::string_body> parser;
    parser.header_limit(shared.options.header_limit);
    parser.body_limit(shared.options.body_limit);
    error_code error;
    {
        std::function<void()> cancel = [&stream] { beast::get_lowest_layer(stream).cancel(); };
        const Listed listed(shared.reading, cancel);
        deadline_of(stream, shared.options.deadline);
        co_await http::async_read(stream, buffer, parser, into(error));
    }
    if (error == http::error::end_of_stream || error == beast::error::timeout ||
        error == asio::error::operation_aborted)
        co_return false;
    if (error) co_return co_await send(shared, stream, refusal(error), false);
    co_return co_await answer_one(shared, stream, parser.get());
}

class Counted {
public:
    Counted(Shared& shared, std::size_t& count) : shared_(shared), count_(count) {
        ++count_;
        shared_.metrics.connection_opened();
    }
    Counted(const Counted&) = delete;
    Counted& operator=(const Counted&) = delete;
    ~Counted() {
        --count_;
        shared_.metrics.connection_closed();
    }

private:
    Shared& shared_;
    std::size_t& count_;
};

/// Requests one after the other; all the others' connections are counted by `count`.
template <typename Stream>
Task<> serve_requests(Shared& shared, Stream& stream, std::size_t count) {
    beast::flat_buffer buffer;
    if (count > shared.options.max_connections) {
        shared.metrics.refused();
        co_await send(shared, stream, problem(503, "too many connections", "close one, or try again"), false);
    } else {
        while (co_await serve_one(shared, stream, buffer)) {
        }
    }
}

template <typename Stream>
void hang_up(Stream& stream) {
    error_code ignored;
    auto& lowest = beast::get_lowest_layer(stream);
    lowest.socket().shutdown(asio::socket_base::shutdown_both, ignored);
    lowest.close();
}

/// Whether there is a stream now to speak HTTP on. A stranger may be slow: others do not wait for it.
Task<bool> shake_hands(Shared& shared, TlsStream& stream) {
    std::function<void()> cancel = [&stream] { beast::get_lowest_layer(stream).cancel(); };
    const Listed listed(shared.reading, cancel);
    error_code error;
    deadline_of(stream, shared.options.deadline);
    co_await stream.async_handshake(asio::ssl::stream_base::server, into(error));
    if (error) shared.metrics.refused();
    co_return !error;
}

/// Tells the other side that this was all (RFC 8446, section 6.1), so that nobody can cut an answer short unseen.
Task<> say_goodbye(TlsStream& stream) {
    error_code ignored;
    deadline_of(stream, std::chrono::seconds(1));
    co_await stream.async_shutdown(into(ignored));
}

}  // namespace

Task<std::vector<Event>> next_events(Shared& shared, std::uint64_t& number) {
    auto events = shared.log.after(number);
    if (events.empty() && !shared.log.closed()) {
        asio::steady_timer wake(shared.io, shared.options.heartbeat);
        const Listed listed(shared.listening, wake);
        error_code woken;
        co_await wake.async_wait(into(woken));
        events = shared.log.after(number);
    }
    if (!events.empty()) number = events.back().number;
    co_return events;
}

Task<> serve(std::shared_ptr<Shared> shared, UnixStream stream) {
    const Counted counted(*shared, shared->local_connections);
    co_await serve_requests(*shared, stream, shared->local_connections);
    hang_up(stream);
}
Task<> serve(std::shared_ptr<Shared> shared, TcpStream stream) {
    const Counted counted(*shared, shared->tcp_connections);
    co_await serve_requests(*shared, stream, shared->tcp_connections);
    hang_up(stream);
}
Task<> serve(std::shared_ptr<Shared> shared, TlsStream stream) {
    const Counted counted(*shared, shared->tcp_connections);
    if (co_await shake_hands(*shared, stream)) {
        co_await serve_requests(*shared, stream, shared->tcp_connections);
        if (!shared->stopping) co_await say_goodbye(stream);
    }
    hang_up(stream);
}

}  // namespace darkbox
