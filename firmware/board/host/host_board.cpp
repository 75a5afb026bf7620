#include "firmware/board/host/host_board.h"

#include <algorithm>
#include <cstring>

namespace darkbox::lampctl {

using namespace lamp_protocol;

Identity sealed(Identity identity) {
    identity.crc = crc16(&identity, offsetof(Identity, crc));
    return identity;
}

std::vector<std::uint8_t> packet_of(Command command, std::uint8_t sequence, const void* payload, std::size_t size) {
    std::vector<std::uint8_t> packet(sizeof(CommandHeader) + size);
    packet[0] = static_cast<std::uint8_t>(command);
    packet[1] = sequence;
    if (size > 0) std::memcpy(packet.data() + sizeof(CommandHeader), payload, size);
    const std::uint16_t crc = packet_crc(packet.data(), packet.size());
    std::memcpy(packet.data() + offsetof(CommandHeader, crc), &crc, sizeof crc);
    return packet;
}

Identity HostBoard::some_identity() {
    Identity identity{};
    identity.layout = identity_layout;
    identity.lamps = 64;
    identity.most_lit = 2;
    identity.most_on_ms = 5000;
    identity.hot = 200;
    std::strcpy(identity.serial, "HOST-1");
    std::strcpy(identity.label, "bench");
    return sealed(identity);
}

HostBoard::HostBoard(const Identity& identity) { controller_.identify(identity); }

void HostBoard::show(const LampSet& lamps, std::uint8_t level) {
    lit_ = lamps;
    level_ = level;
    if (on_show) on_show(lamps, level);
}

void HostBoard::trigger(bool active) {
    triggered_ = active;
    if (on_trigger) on_trigger(active);
}

void HostBoard::receive(const std::vector<std::uint8_t>& packet) {
    const auto size = static_cast<std::uint8_t>(packet.size());
    controller_.execute(packet.data(), size, Controller::check(packet.data(), size), clock_us());
}

Event HostBoard::command(Command command, const void* payload, std::size_t size) {
    fetch_events();
    receive(packet_of(command, ++sequence_, payload, size));
    fetch_events();
    const auto is_reply = [&](const Event& e) { return e.kind == EventKind::reply && e.sequence == sequence_; };
    const auto reply = std::find_if(events.rbegin(), events.rend(), is_reply);
    const Event found = *reply;
    events.erase(std::next(reply).base());
    return found;
}

void HostBoard::fetch_events() {
    for (EventQueue& queue = controller_.events(); !queue.empty(); queue.pop()) events.push_back(queue.front());
}

void HostBoard::run_us(std::uint64_t microseconds) {
    const std::uint64_t end = now_us_ + microseconds;
    while (now_us_ < end) {
        std::uint64_t next = std::min(end, next_tick_us_);
        if (controller_.waits()) {
            const auto ahead = static_cast<std::int32_t>(controller_.deadline_us() - clock_us());
            next = std::min(next, now_us_ + static_cast<std::uint64_t>(std::max(ahead, 0)));
        }
        now_us_ = next;
        controller_.advance(clock_us());
        if (now_us_ < next_tick_us_) continue;
        next_tick_us_ += 1000;
        controller_.tick(clock_us());
        controller_.temperature(thermistor, clock_us());
    }
}

}  // namespace darkbox::lampctl
