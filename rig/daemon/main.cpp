#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <csignal>
#include <cstdio>
#include <filesystem>
#include <optional>

#include "acquisition/frame/error.h"
#include "rig/daemon/api.h"
#include "rig/daemon/client.h"
#include "rig/daemon/hardware.h"
#include "rig/daemon/http_server.h"
#include "rig/daemon/notify.h"
#include "rig/daemon/processing_command.h"
#include "rig/daemon/service.h"
#include "rig/daemon/session_folder.h"

namespace darkbox {
namespace {

namespace fs = std::filesystem;

struct DaemonOptions {
    fs::path config;
    bool simulate = false;
    int lamps = 12;
    fs::path socket;
    fs::path sessions;
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

/// Never throws, unlike fmt::print: stderr may be closed.
void put(const std::string& text) { std::fputs(text.c_str(), stderr); }

/// Everything the daemon is, wired together.
class Daemon {
public:
    Daemon(RigDescription rig, const fs::path& socket, const fs::path& sessions)
        : rig_(std::move(rig)),
          hardware_(rig_),
          signals_(io_, SIGINT, SIGTERM, SIGHUP),
          watchdog_(io_),
          leave_(io_),
          server_(
              io_, server_options(socket), [this](const ApiRequest& request) { return api_->answer(request); }, log_) {
        fs::create_directories(sessions);
        ServiceOptions options{.sessions = sessions};
        options.run_processing = processing_by(darkbox_beside_this_program());
        service_.emplace([this] { return hardware_.open(); }, options, log_);
        api_.emplace(rig_, *service_, metrics_);
        await_signal();
        feed_watchdog();
    }

    void run() {
        notify_ready();
        io_.run();
    }

    std::optional<std::string> stop() { return service_->stop(); }

private:
    static HttpServerOptions server_options(const fs::path& socket) {
        HttpServerOptions options;
        options.socket = socket;
        return options;
    }

    /// The first signal lets the capture end in the dark and its listeners hear of it; the second does not wait for
    /// them.
    void await_signal() {
        signals_.async_wait([this](const boost::system::error_code& error, int) {
            if (error) return;
            notify_stopping();
            service_->request_stop();
            server_.stop();
            watchdog_.cancel();
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

    const RigDescription rig_;
    Hardware hardware_;  // forks: before whatever starts a thread
    EventLog log_;
    asio::io_context io_;
    asio::signal_set signals_;
    asio::steady_timer watchdog_;
    asio::steady_timer leave_;
    bool stopping_ = false;
    HttpServer server_;
    Metrics metrics_;
    std::optional<Service> service_;
    std::optional<Api> api_;
};

int run(const DaemonOptions& options) {
    RigDescription rig = load(options);
    const fs::path socket = first_given(options.socket, rig.socket, default_socket);
    const fs::path sessions = first_given(options.sessions, rig.sessions_folder, default_sessions_folder);
    put(fmt::format("darkboxd: rig {}, {} lamps, socket {}, sessions {}\n", rig.name, rig.lamps.size(), socket.string(),
                    sessions.string()));
    const auto not_dark = [&] {
        Daemon daemon(std::move(rig), socket, sessions);
        daemon.run();
        return daemon.stop();
    }();
    if (not_dark) {
        put(fmt::format("darkboxd: error: stopped, but the lamps could not be proven dark: {}\n", *not_dark));
        return 1;
    }
    put("darkboxd: stopped, lamps dark\n");
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
        darkbox::put(fmt::format("darkboxd: error: {}\n  {}\n", error.what(), error.hint()));
    } catch (const std::exception& error) {
        darkbox::put(fmt::format("darkboxd: error: {}\n", error.what()));
    }
    return 1;
}
