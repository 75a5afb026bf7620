#include <fmt/format.h>
#include <systemd/sd-daemon.h>

#include <CLI/CLI.hpp>
#include <chrono>
#include <cstdio>

#include "acquisition/frame/error.h"
#include "rig/lamps/guardian_process.h"

namespace darkbox {
namespace {

UniqueFd inherited_socket() {
    constexpr int listening = 1;
    const int count = ::sd_listen_fds(/*unset_environment=*/1);
    UniqueFd socket(count == 1 ? SD_LISTEN_FDS_START : -1);
    if (!socket || ::sd_is_socket_unix(socket.get(), SOCK_SEQPACKET, listening, nullptr, 0) <= 0)
        throw InputError("systemd has handed over no listening Unix socket for packets, or more than one",
                         "sudo systemctl start darkbox-guardian.socket; whoever comes to it starts this program");
    return socket;
}

int parse_and_guard(int argc, char** argv) {
    CLI::App app("Holds the lines of GPIO lamps for darkboxd, and darkens them when it dies or hangs",
                 "darkbox-guardian");
    app.set_version_flag("--version", std::string("darkbox-guardian ") + DARKBOX_VERSION);
    app.footer(
        "Started by systemd with darkboxd, on the socket of darkbox-guardian.socket: /run/darkbox/guardian.sock");
    try {
        app.parse(argc, argv);
    } catch (const CLI::ParseError& error) {
        constexpr int wrong_usage = 2;
        return app.exit(error) == 0 ? 0 : wrong_usage;
    }
    serve_guardian(inherited_socket(), request_gpio_lines, std::chrono::seconds(1));
    return 0;
}

}  // namespace
}  // namespace darkbox

int main(int argc, char** argv) {
    try {
        return darkbox::parse_and_guard(argc, argv);
    } catch (const darkbox::Error& error) {
        fmt::print(stderr, "darkbox-guardian: {}\n  {}\n", error.what(), error.hint());
    } catch (const std::exception& error) {
        fmt::print(stderr, "darkbox-guardian: {}\n", error.what());
    }
    return 1;
}
