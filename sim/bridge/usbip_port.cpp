#include "sim/bridge/usbip_port.h"

#include <arpa/inet.h>
#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>

#include "acquisition/device/device_error.h"

namespace darkbox::sim {
namespace {

constexpr std::uint32_t cmd_submit = 1, cmd_unlink = 2, ret_submit = 3, ret_unlink = 4;
constexpr std::uint32_t largest_transfer = 1U << 20;
constexpr const char* attach_file = "/sys/devices/platform/vhci_hcd.0/attach";
constexpr std::uint8_t to_host = 0x80;

UsbRequest parse(const std::array<std::uint8_t, 8>& setup) {
    const auto word = [&](std::size_t i) { return static_cast<std::uint16_t>(setup.at(i) | setup.at(i + 1) << 8); };
    return {setup[0], setup[1], word(2), word(4), word(6)};
}

}  // namespace

/// One form for all four messages: the last words mean what the command says.
struct UsbIpPort::Header {
    std::uint32_t command = 0;
    std::uint32_t sequence = 0;
    std::uint32_t device = 0;
    std::uint32_t to_host = 0;
    std::uint32_t endpoint = 0;
    std::array<std::uint32_t, 5> word{};  ///< submit: flags, length, ...; its answer: status, length, start, packets
    std::array<std::uint8_t, 8> setup{};
};

UsbIpPort::UsbIpPort(UsbFunction& function, Clock& clock, int port) : function_(function), clock_(clock) {
    static_assert(sizeof(Header) == 48);
    std::array<int, 2> ends{};
    if (::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends.data()) != 0) throw_errno("socketpair", "", errno);
    socket_.reset(ends[0]);
    const UniqueFd kernels(ends[1]);
    const UniqueFd attach(::open(attach_file, O_WRONLY | O_CLOEXEC));
    const std::string order =
        fmt::format("{} {} {} {}", port, kernels.get(), 1 << 16 | (port + 2), static_cast<int>(function.speed()));
    if (!attach) throw_errno("open", attach_file, errno, "load the module vhci-hcd, and run this as root");
    if (::write(attach.get(), order.data(), order.size()) != static_cast<ssize_t>(order.size()))
        throw_errno("write", attach_file, errno, "another device may be in that port");
}

bool UsbIpPort::wait_for_host(TimePoint until) {
    const auto left = std::chrono::ceil<std::chrono::milliseconds>(until - clock_.now()).count();
    pollfd wait{.fd = socket_.get(), .events = POLLIN, .revents = 0};
    return !gone_ && ::poll(&wait, 1, static_cast<int>(std::clamp<std::int64_t>(left, 0, 60'000))) > 0;
}

void UsbIpPort::serve(TimePoint until) {
    while (wait_for_host(until)) serve_one();
}

void UsbIpPort::serve_until_waiting(std::uint8_t endpoint, TimePoint until) {
    while (!is_waiting(endpoint) && wait_for_host(until)) serve_one();
}

bool UsbIpPort::is_waiting(std::uint8_t endpoint) const {
    return std::any_of(waiting_.begin(), waiting_.end(), [&](const auto& t) { return t.endpoint == endpoint; });
}

void UsbIpPort::finish(std::uint32_t id, int error, std::span<const std::uint8_t> data) {
    const auto found = std::find_if(waiting_.begin(), waiting_.end(), [&](const auto& t) { return t.id == id; });
    if (found == waiting_.end()) return;
    const auto went = data.first(std::min<std::size_t>(data.size(), found->length));
    const bool in = (found->endpoint & to_host) != 0;
    waiting_.erase(found);
    reply(id, error, static_cast<std::uint32_t>(went.size()), in ? went : std::span<const std::uint8_t>());
}

void UsbIpPort::complete(std::uint8_t endpoint, std::span<const std::uint8_t> data) {
    const auto oldest =
        std::find_if(waiting_.begin(), waiting_.end(), [&](const auto& t) { return t.endpoint == endpoint; });
    finish(oldest->id, 0, data);
}

void UsbIpPort::serve_one() {
    Header header;
    if (!receive(&header, sizeof header)) return;
    for (std::uint32_t* field : {&header.command, &header.sequence, &header.to_host, &header.endpoint})
        *field = ntohl(*field);
    for (std::uint32_t& word : header.word) word = ntohl(word);
    if (header.command == cmd_submit)
        submit(header);
    else if (header.command == cmd_unlink)
        unlink(header);
    else
        gone_ = true;
}

void UsbIpPort::submit(const Header& header) {
    const std::uint32_t length = header.word[1];
    UsbBytes data;
    if (header.to_host == 0 && length > 0) {
        data.resize(std::min(length, largest_transfer));
        if (length > largest_transfer || !receive(data.data(), data.size())) {
            gone_ = true;
            return;
        }
    }
    if (header.endpoint == 0) return control(header, data);
    const auto direction = header.to_host != 0 ? to_host : std::uint8_t{0};
    const auto endpoint = static_cast<std::uint8_t>(header.endpoint | direction);
    waiting_.push_back({header.sequence, endpoint, length, std::move(data)});
}

/// The host takes a transfer back. One that was answered already is answered with 0.
void UsbIpPort::unlink(const Header& header) {
    const std::uint32_t victim = header.word[0];
    const bool waited = std::erase_if(waiting_, [&](const UsbTransfer& t) { return t.id == victim; }) > 0;
    const int status = waited ? -ECONNRESET : 0;
    Header answer;
    answer.command = htonl(ret_unlink);
    answer.sequence = htonl(header.sequence);
    answer.word[0] = htonl(static_cast<std::uint32_t>(status));
    send({reinterpret_cast<const std::uint8_t*>(&answer), sizeof answer});
}

void UsbIpPort::control(const Header& header, std::span<const std::uint8_t> data) {
    const UsbRequest request = parse(header.setup);
    const auto answer = function_.control(request, data);
    if (!answer) return reply(header.sequence, -EPIPE, 0, {});
    if ((request.type & to_host) == 0) return reply(header.sequence, 0, static_cast<std::uint32_t>(data.size()), {});
    const std::size_t most = std::min<std::size_t>(request.length, header.word[1]);
    const auto sent = std::span(*answer).first(std::min(answer->size(), most));
    reply(header.sequence, 0, static_cast<std::uint32_t>(sent.size()), sent);
}

void UsbIpPort::reply(std::uint32_t sequence, int status, std::uint32_t length, std::span<const std::uint8_t> data) {
    constexpr std::uint32_t not_isochronous = 0xffffffff;
    Header answer;
    answer.command = htonl(ret_submit);
    answer.sequence = htonl(sequence);
    answer.word = {htonl(static_cast<std::uint32_t>(status)), htonl(length), 0, not_isochronous, 0};
    send({reinterpret_cast<const std::uint8_t*>(&answer), sizeof answer});
    send(data);
}

bool UsbIpPort::receive(void* bytes, std::size_t size) {
    auto* to = static_cast<std::uint8_t*>(bytes);
    while (size > 0 && !gone_) {
        const ssize_t got = ::recv(socket_.get(), to, size, 0);
        if (got < 0 && errno == EINTR) continue;
        gone_ = got <= 0;
        if (gone_) break;
        to += got;
        size -= static_cast<std::size_t>(got);
    }
    return size == 0;
}

void UsbIpPort::send(std::span<const std::uint8_t> bytes) {
    while (!bytes.empty() && !gone_) {
        const ssize_t sent = ::send(socket_.get(), bytes.data(), bytes.size(), MSG_NOSIGNAL);
        if (sent < 0 && errno == EINTR) continue;
        gone_ = sent <= 0;
        if (!gone_) bytes = bytes.subspan(static_cast<std::size_t>(sent));
    }
}

}  // namespace darkbox::sim
