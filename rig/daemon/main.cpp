#include <fmt/format.h>
#include <grp.h>
#include <sys/socket.h>
#include <sys/un.h>

#include <CLI/CLI.hpp>
#include <charconv>
#include <csignal>
#include <filesystem>
#include <optional>

#include "acquisition/frame/error.h"
#include "rig/daemon/api.h"
#include "rig/daemon/attempt.h"
#include "rig/daemon/client.h"
#include "rig/daemon/hardware.h"
#include "rig/daemon/http_server.h"
#include "rig/daemon/notify.h"
#include "rig/daemon/processing_command.h"
#include "rig/daemon/service.h"
#include "rig/daemon/session_folder.h"
#include "rig/daemon/structured_log.h"

namespace darkbox {
namespace {

namespace fs = std::filesystem;

struct DaemonOptions {
    fs::path config;
    bool simulate = false;
    int lamps = 12;
    fs::path socket;
    fs::path sessions;
    std::string listen;
    std::string log_level = "info";
};

RigDescription load(const DaemonOptions& options) {
    if (options.simulate) return parse_rig(simulated_rig_toml(options.lamps), "built-in simulated rig");
    if (options.config.empty())
        throw InputError("no rig is given", "give --config rig.toml, or --simulate for the simulated rig");
    return load_rig(options.config);
}

fs::path first_given(const fs::path& option, const fs::path& configured, fs::path (*otherwise)()) {
    if (!option.empty()) return option;
    return configured.empty() ? otherwise() : configured;
}

PeerAccess peers_of(const std::string& group) {
    if (group.empty()) return {};
    const struct group* entry = ::getgrnam(group.c_str());
    if (entry == nullptr)
        throw InputError(fmt::format("there is no group \"{}\"", group), "make it: groupadd --system " + group);
    return {.group = entry->gr_gid};
}

/// What the capture writes, at most: every plane of every frame in 16 bits, and a bit for the papers. A camera that has
/// not said its size yet is taken for a large one.
std::uint64_t capture_bytes(const RigDescription& rig, const CaptureOrder& order) {
    constexpr std::uint64_t large = 24'000'000;  // pixels
    constexpr std::uint64_t papers = 1 << 20;
    const bool simulated = rig.camera.driver == "sim";
    const auto width = static_cast<std::uint64_t>(simulated ? rig.sim.width : rig.camera.width);
    const auto height = static_cast<std::uint64_t>(simulated ? rig.sim.height : rig.camera.height);
    const std::uint64_t pixels = width * height > 0 ? width * height : large;
    const std::string& format = rig.camera.format;
    const bool colour = format == "MJPG" || format.starts_with("RGB") || format.starts_with("BGR");
    const std::uint64_t planes = colour ? 3 : 1;
    const std::size_t lamps = order.lamps.empty() ? rig.lamps.size() : order.lamps.size();
    const auto brackets = static_cast<std::uint64_t>(rig.capture.brackets.size());
    const auto lit = lamps * static_cast<std::uint64_t>(rig.capture.averages);
    const std::uint64_t between =
        rig.capture.dark_every > 0 ? lit / static_cast<std::uint64_t>(rig.capture.dark_every) : 0;
    return brackets * (lit + between + 2) * pixels * planes * 2 + papers;
}

/// "127.0.0.1:7640" or "[::1]:7640"
TcpListen listen_from(const std::string& text) {
    const auto colon = text.rfind(':');
    TcpListen listen;
    unsigned port = 0;
    const char* end = text.data() + text.size();
    const bool good = colon != text.npos && std::from_chars(text.data() + colon + 1, end, port).ptr == end &&
                      colon + 1 < text.size() && port <= 65535;
    if (!good) throw InputError(fmt::format("\"{}\" is not an address and a port", text), "write 127.0.0.1:7640");
    listen.address = text.substr(0, colon);
    if (listen.address.starts_with('[') && listen.address.ends_with(']'))
        listen.address = listen.address.substr(1, listen.address.size() - 2);
    listen.port = static_cast<unsigned short>(port);
    return listen;
}

std::string address_of(const HttpServer& server, bool tls) {
    const std::string address = server.address();
    const bool v6 = address.find(':') != address.npos;
    return fmt::format("{}://{}{}{}:{}", tls ? "https" : "http", v6 ? "[" : "", address, v6 ? "]" : "", server.port());
}

/// Where the Unix socket is that systemd listens on.
fs::path path_of(int listening) {
    sockaddr_un bound{};
    socklen_t size = sizeof bound;
    if (::getsockname(listening, reinterpret_cast<sockaddr*>(&bound), &size) != 0 || bound.sun_path[0] == '\0')
        throw InputError("the socket that systemd handed over has no path",
                         "give darkboxd.socket a ListenStream=/run/...");
    return bound.sun_path;
}

/// Everything the daemon is, wired together.
class Daemon {
public:
    Daemon(RigDescription rig, const HttpServerOptions& http, const fs::path& sessions, const LogSink& log)
        : rig_(std::move(rig)),
          hardware_(rig_),
          signals_(io_, SIGINT, SIGTERM, SIGHUP),
          watchdog_(io_),
          leave_(io_),
          pruning_(io_),
          server_(io_, http, [this](const ApiRequest& request) { return api_->answer(request); }, log_, metrics_) {
        fs::create_directories(sessions);
        ServiceOptions options{.sessions = sessions};
        options.bytes_needed = [this](const CaptureOrder& order) { return capture_bytes(rig_, order); };
        options.run_processing = processing_by(darkbox_beside_this_program());
        options.retention = rig_.retention;
        options.shine = [this, sessions](const HandLight& light, const LentDevices& d, const WorkContext& work) {
            shine(light, rig_, d.lamps, d.clock, sessions, work, d.look_at_door);
        };
        options.log = log;
        log_.tee([log](const std::string& event, const nlohmann::json& fields) { log(log_line_of(event, fields)); });
        service_.emplace([this] { return hardware_.open(); }, options, log_);
        api_.emplace(rig_, *service_, metrics_);
        await_signal();
        feed_watchdog();
        if (rig_.retention) prune_in(first_pruning);
    }

    Daemon(const Daemon&) = delete;
    Daemon& operator=(const Daemon&) = delete;
    ~Daemon() { server_.release_handler(); }

    const HttpServer& server() const { return server_; }

    void run() {
        notify_ready();
        io_.run();
    }

    std::optional<std::string> stop() { return service_->stop(); }

private:
    /// The first signal lets the capture end in the dark and its listeners hear of it; the second does not wait for
    /// them.
    void await_signal() {
        signals_.async_wait([this](const boost::system::error_code& error, int) {
            if (error) return;
            notify_stopping();
            service_->request_stop();
            server_.stop();
            watchdog_.cancel();
            pruning_.cancel();
            stopping_ = true;
            signals_.async_wait([this](const boost::system::error_code& cancelled, int) {
                if (!cancelled) io_.stop();
            });
            leave_once_closed();
        });
    }

    /// Once the log is closed, the streams end by themselves; a listener that does not read is not waited for long.
    void leave_once_closed() {
        const bool closed = log_.closed();
        if (closed) signals_.cancel();
        leave_.expires_after(closed ? std::chrono::milliseconds(500) : std::chrono::milliseconds(20));
        leave_.async_wait(
            [this, closed](const boost::system::error_code&) { closed ? io_.stop() : leave_once_closed(); });
    }

    void feed_watchdog() {
        const auto period = watchdog_period();
        if (!period || stopping_) return;
        notify_alive();
        watchdog_.expires_after(*period);
        watchdog_.async_wait([this](const boost::system::error_code& error) {
            if (!error) feed_watchdog();
        });
    }

    /// By [retention]; what keeps one from being queued keeps it only until the next.
    void prune_in(std::chrono::minutes wait) {
        pruning_.expires_after(wait);
        pruning_.async_wait([this](const boost::system::error_code& error) {
            if (error || stopping_) return;
            if (const auto failure = attempt([this] { service_->enqueue({.kind = JobKind::prune}); }))
                log_.publish("problem", {{"detail", failure->what}, {"hint", failure->hint}});
            prune_in(every_pruning);
        });
    }

    static constexpr std::chrono::minutes first_pruning{10};
    static constexpr std::chrono::minutes every_pruning{24 * 60};

    const RigDescription rig_;
    Hardware hardware_;  // forks: before whatever starts a thread
    EventLog log_;
    asio::io_context io_;
    asio::signal_set signals_;
    asio::steady_timer watchdog_;
    asio::steady_timer leave_;
    asio::steady_timer pruning_;
    bool stopping_ = false;
    Metrics metrics_;
    HttpServer server_;
    std::optional<Service> service_;
    std::optional<Api> api_;
};

int run(const DaemonOptions& options) {
    const LogSink log = log_sink(log_level_from_name(options.log_level));
    const InheritedSockets inherited = inherited_sockets();  // before anything forks
    RigDescription rig = load(options);
    const fs::path socket =
        inherited.local ? path_of(*inherited.local) : first_given(options.socket, rig.socket, default_socket);
    const fs::path asked = !options.socket.empty() ? options.socket : rig.socket;
    if (inherited.local && !asked.empty() && asked != socket)
        log({LogLevel::warning,
             "listens where systemd does",
             {{"socket", socket.string()}, {"not", asked.string()}, {"hint", "systemctl edit darkboxd.socket"}}});
    const fs::path sessions = first_given(options.sessions, rig.sessions_folder, default_sessions_folder);
    HttpServerOptions http;
    http.socket = socket;
    http.listening = inherited.local;
    http.peers = peers_of(rig.socket_group);
    const std::string listen = options.listen.empty() ? rig.listen : options.listen;
    const fs::path token_file =
        rig.token_file.empty() ? fs::absolute(socket).parent_path() / "darkbox.token" : rig.token_file;
    log({LogLevel::info,
         "darkboxd " DARKBOX_VERSION " starts",
         {{"rig", rig.name},
          {"lamps", std::to_string(rig.lamps.size())},
          {"socket", socket.string()},
          {"sessions", sessions.string()}}});
    if (!listen.empty()) http.tcp = listen_from(listen);
    if (inherited.tcp) http.tcp = TcpListen{.listening = inherited.tcp};
    if (http.tcp) {
        http.tcp->token = token_in(token_file);
        if (!rig.certificate.empty()) http.tcp->tls = TlsFiles{.certificate = rig.certificate, .key = rig.key};
    }
    const auto not_dark = [&] {
        Daemon daemon(std::move(rig), http, sessions, log);
        if (http.tcp)
            log({LogLevel::info,
                 "listening",
                 {{"address", address_of(daemon.server(), http.tcp->tls.has_value())},
                  {"token_file", token_file.string()}}});
        daemon.run();
        return daemon.stop();
    }();
    if (not_dark) {
        log({LogLevel::error, "stopped, but the lamps could not be proven dark", {{"detail", *not_dark}}});
        return 1;
    }
    log({LogLevel::info, "stopped, lamps dark"});
    return 0;
}

int parse_and_run(int argc, char** argv) {
    DaemonOptions options;
    CLI::App app("Runs a photometric rig and lets darkbox drive it over a Unix socket", "darkboxd");
    app.set_version_flag("--version", std::string("darkboxd ") + DARKBOX_VERSION);
    auto* config = app.add_option("--config", options.config, "The rig's description, rig.toml");
    auto* simulate = app.add_flag("--simulate", options.simulate, "The built-in simulated rig")->excludes(config);
    app.add_option("--lamps", options.lamps, "Lamps of the simulated rig; 12 unless given")->needs(simulate);
    app.add_option("--socket", options.socket,
                   "Where to listen; else [api] socket, $DARKBOX_SOCKET, $XDG_RUNTIME_DIR/darkbox.sock");
    app.add_option("--sessions", options.sessions,
                   "The folder of the sessions; else [api] sessions, $DARKBOX_SESSIONS, ./sessions");
    app.add_option(
        "--listen", options.listen,
        "Listen on this address, too (127.0.0.1:7640), for who has the token; else [api] listen. Loopback only, "
        "unless [api] names a certificate and a key");
    app.add_option("--log-level", options.log_level, "error, warning, notice, info (default) or debug");
    app.footer("Example:\n  darkboxd --simulate --lamps 12 --socket /tmp/darkbox.sock --sessions ./sessions");
    try {
        app.parse(argc, argv);
    } catch (const CLI::ParseError& error) {
        constexpr int wrong_usage = 2;
        return app.exit(error) == 0 ? 0 : wrong_usage;
    }
    return run(options);
}

}  // namespace
}  // namespace darkbox

int main(int argc, char** argv) {
    try {
        return darkbox::parse_and_run(argc, argv);
    } catch (const darkbox::Error& error) {
        darkbox::log_sink(darkbox::LogLevel::error)({darkbox::LogLevel::error, error.what(), {{"hint", error.hint()}}});
    } catch (const std::exception& error) {
        darkbox::log_sink(darkbox::LogLevel::error)({darkbox::LogLevel::error, error.what()});
    }
    return 1;
}
