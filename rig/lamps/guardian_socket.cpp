#include "rig/lamps/guardian_socket.h"

#include <fmt/format.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/un.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstdlib>

#include "acquisition/device/clock.h"
#include "acquisition/device/device_error.h"
#include "rig/lamps/guardian_packets.h"

namespace darkbox {
namespace {

namespace fs = std::filesystem;

constexpr const char* start_anew = "sudo systemctl restart darkbox-guardian, which restarts darkboxd as well";

GuardianGreeting await_greeting(const UniqueFd& channel, const fs::path& socket, Nanoseconds within) {
    if (!await_packet(channel, within))
        throw DeviceError(fmt::format("the lamps' guardian at {} does not answer", socket.string()), start_anew);
    GuardianGreeting greeting;
    const ssize_t size = ::recv(channel.get(), &greeting, sizeof greeting, MSG_TRUNC);
    if (size <= 0)
        throw DeviceError(fmt::format("the lamps' guardian at {} hung up", socket.string()),
                          "it hears root and the user it runs as, by name darkbox, alone");
    if (size != static_cast<ssize_t>(sizeof greeting) || greeting.version != GuardianGreeting::this_version)
        throw DeviceError(fmt::format("the lamps' guardian at {} is of another version of darkbox", socket.string()),
                          start_anew);
    return greeting;
}

}  // namespace

fs::path guardian_socket() {
    const char* given = std::getenv("DARKBOX_GUARDIAN");
    return given == nullptr ? "/run/darkbox/guardian.sock" : given;
}

std::optional<GuardianConnection> connect_guardian(const fs::path& socket, Nanoseconds greeting_within) {
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    if (socket.string().size() >= sizeof address.sun_path)
        throw InputError(fmt::format("the path of the guardian's socket {} is too long", socket.string()),
                         "set DARKBOX_GUARDIAN to a shorter one");
    socket.string().copy(address.sun_path, sizeof address.sun_path - 1);
    UniqueFd channel(::socket(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
    if (!channel) throw_errno("socket", "of the lamps' guardian", errno);
    if (::connect(channel.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0) {
        if (errno == ENOENT || errno == ECONNREFUSED || errno == EACCES || errno == ENOTDIR) return std::nullopt;
        throw_errno("connect", socket.string(), errno);
    }
    const GuardianGreeting greeting = await_greeting(channel, socket, greeting_within);
    if (greeting.process <= 0) throw DeviceError(greeting.reply.what.data(), greeting.reply.hint.data());
    return GuardianConnection{.channel = std::move(channel), .process = greeting.process};
}

bool await_packet(const UniqueFd& channel, Nanoseconds within) {
    SystemClock clock;
    const TimePoint deadline = clock.now() + within;
    int ready = 0;
    do {
        const auto left = std::chrono::ceil<std::chrono::milliseconds>(deadline - clock.now()).count();
        pollfd wait{.fd = channel.get(), .events = POLLIN, .revents = 0};
        ready = ::poll(&wait, 1, static_cast<int>(std::max<std::int64_t>(left, 0)));
    } while (ready < 0 && errno == EINTR);
    return ready > 0;
}

}  // namespace darkbox
