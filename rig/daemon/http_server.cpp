#include "rig/daemon/http_server.h"

#include <set>

namespace darkbox {

/// What the connections share. They hold it themselves: a connection may outlive the server object by a moment.
struct HttpServer::Shared {
    asio::io_context& io;
    const HttpServerOptions options;
    const Handler handler;
    EventLog& log;
    bool stopping = false;
    std::size_t connections = 0;
    std::set<UnixStream*> reading = {};            ///< waiting for a request
    std::set<asio::steady_timer*> listening = {};  ///< waiting for an event
};

namespace {

using Shared = HttpServer::Shared;
using boost::system::error_code;
template <typename T = void>
using Task = asio::awaitable<T>;

auto into(error_code& error) { return asio::redirect_error(asio::use_awaitable, error); }

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

class Counted {
public:
    explicit Counted(std::size_t& count) : count_(count) { ++count_; }
    Counted(const Counted&) = delete;
    Counted& operator=(const Counted&) = delete;
    ~Counted() { --count_; }

private:
    std::size_t& count_;
};

using Request = http::request<http::string_body>;
using Response = http::response<http::string_body>;

Response make_response(const ApiResponse& answer, bool keep_alive) {
    Response response(http::int_to_status(static_cast<unsigned>(answer.status)), 11);
    response.set(http::field::server, "darkboxd");
    response.set(http::field::content_type, answer.content_type);
    response.set(http::field::cache_control, "no-store");
    if (!answer.allow.empty()) response.set(http::field::allow, answer.allow);
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
            .body = request.body()};
}

ApiResponse refusal(const error_code& error) {
    if (error == http::error::body_limit)
        return problem(413, "the request's body is too large", "64 KiB are plenty for any request");
    if (error == http::error::header_limit) return problem(431, "the request's header is too large", "send less");
    return problem(400, "this is not HTTP: " + error.message(), "speak HTTP/1.1");
}

Task<bool> send(Shared& shared, UnixStream& stream, const ApiResponse& answer, bool keep_alive) {
    const Response response = make_response(answer, keep_alive);
    error_code error;
    stream.expires_after(shared.options.deadline);
    co_await http::async_write(stream, response, into(error));
    co_return !error && keep_alive;
}

Task<bool> send_chunk(Shared& shared, UnixStream& stream, const std::string& text) {
    error_code error;
    stream.expires_after(shared.options.deadline);
    co_await asio::async_write(stream, http::make_chunk(asio::buffer(text)), into(error));
    co_return !error;
}

/// Waits for an event, or for the moment of a heartbeat: the text to send.
Task<std::string> next_events(Shared& shared, std::uint64_t& number) {
    auto events = shared.log.after(number);
    if (events.empty() && !shared.log.closed()) {
        asio::steady_timer wake(shared.io, shared.options.heartbeat);
        const Listed listed(shared.listening, wake);
        error_code woken;
        co_await wake.async_wait(into(woken));
        if (!woken) co_return "\n";
        events = shared.log.after(number);
    }
    std::string text;
    for (const Event& event : events) text += event.json + "\n";
    if (!events.empty()) number = events.back().number;
    co_return text;
}

Task<> stream_events(Shared& shared, UnixStream& stream, const ApiResponse& answer) {
    http::response<http::empty_body> head(http::status::ok, 11);
    head.set(http::field::content_type, answer.content_type);
    head.chunked(true);
    head.keep_alive(false);
    http::response_serializer<http::empty_body> serializer(head);
    error_code error;
    stream.expires_after(shared.options.deadline);
    co_await http::async_write_header(stream, serializer, into(error));
    std::uint64_t number = *answer.stream_events;
    while (!error) {
        const std::string text = co_await next_events(shared, number);
        if (text.empty() && shared.log.closed()) break;
        if (!text.empty() && !co_await send_chunk(shared, stream, text)) co_return;
    }
    if (!error) co_await asio::async_write(stream, http::make_chunk_last(), into(error));
}

/// One request and its answer; whether the connection goes on.
Task<bool> serve_one(Shared& shared, UnixStream& stream, beast::flat_buffer& buffer) {
    http::request_parser<http::string_body> parser;
    parser.header_limit(shared.options.header_limit);
    parser.body_limit(shared.options.body_limit);
    error_code error;
    {
        const Listed listed(shared.reading, stream);
        stream.expires_after(shared.options.deadline);
        co_await http::async_read(stream, buffer, parser, into(error));
    }
    if (error == http::error::end_of_stream || error == beast::error::timeout ||
        error == asio::error::operation_aborted)
        co_return false;
    if (error) co_return co_await send(shared, stream, refusal(error), false);

    const ApiResponse answer = shared.handler(to_api(parser.get()));
    if (!answer.stream_events)
        co_return co_await send(shared, stream, answer, parser.get().keep_alive() && !shared.stopping);
    co_await stream_events(shared, stream, answer);
    co_return false;
}

void hang_up(UnixStream& stream) {
    error_code ignored;
    stream.socket().shutdown(UnixProtocol::socket::shutdown_both, ignored);
    stream.close();
}

Task<> serve(std::shared_ptr<Shared> shared, UnixStream stream) {
    const Counted counted(shared->connections);
    beast::flat_buffer buffer;
    if (shared->connections > shared->options.max_connections) {
        co_await send(*shared, stream, problem(503, "too many connections", "close one, or try again"), false);
    } else {
        while (co_await serve_one(*shared, stream, buffer)) {
        }
    }
    hang_up(stream);
}

Task<> accept_all(std::shared_ptr<Shared> shared, UnixProtocol::acceptor& acceptor) {
    while (!shared->stopping) {
        error_code error;
        UnixProtocol::socket socket = co_await acceptor.async_accept(into(error));
        if (shared->stopping || error == asio::error::operation_aborted) co_return;
        if (!error) {
            asio::co_spawn(shared->io, serve(shared, UnixStream(std::move(socket))), asio::detached);
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

HttpServer::HttpServer(asio::io_context& io, const HttpServerOptions& options, Handler handler, EventLog& log)
    : file_(io, options.socket), shared_(std::make_shared<Shared>(Shared{io, options, std::move(handler), log})) {
    log.on_change([shared = std::weak_ptr(shared_), &io] {
        asio::post(io, [shared] {
            if (const auto alive = shared.lock()) wake_listeners(*alive);
        });
    });
    asio::co_spawn(io, accept_all(shared_, file_.acceptor()), asio::detached);
}

HttpServer::~HttpServer() {
    shared_->log.on_change({});
    stop();
}

void HttpServer::stop() {
    shared_->stopping = true;
    error_code ignored;
    file_.acceptor().close(ignored);
    for (UnixStream* stream : shared_->reading) stream->cancel();
}

}  // namespace darkbox
