#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>

#include "rig/daemon/api.h"
#include "rig/daemon/events.h"
#include "rig/daemon/socket_file.h"

namespace darkbox {

struct HttpServerOptions {
    std::filesystem::path socket;
    std::uint32_t header_limit = 8 * 1024;  ///< bytes
    std::uint64_t body_limit = 64 * 1024;   ///< bytes
    std::size_t max_connections = 32;
    std::chrono::milliseconds deadline{10'000};   ///< for one whole request, and for writing one answer
    std::chrono::milliseconds heartbeat{15'000};  ///< between lines of an event stream where nothing happens
};

/// HTTP/1.1 on a Unix socket: hands requests to `handler` and streams events. All its work happens in io.run(), on one
/// thread; the handler must not block. Thread-compatible, but for what EventLog calls.
class HttpServer {
public:
    using Handler = std::function<ApiResponse(const ApiRequest&)>;

    HttpServer(asio::io_context& io, const HttpServerOptions& options, Handler handler, EventLog& log);
    HttpServer(const HttpServer&) = delete;
    HttpServer& operator=(const HttpServer&) = delete;
    ~HttpServer();

    /// Takes no more connections and closes those that wait for a request. Event streams end by themselves once the
    /// event log is closed; then io.run() runs out of work.
    void stop();

    struct Shared;

private:
    SocketFile file_;
    std::shared_ptr<Shared> shared_;
};

}  // namespace darkbox
