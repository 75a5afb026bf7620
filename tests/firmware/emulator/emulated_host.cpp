#include "tests/firmware/emulator/emulated_host.h"

#include <stdexcept>

#include "firmware/board/host/host_board.h"

namespace darkbox::test {
namespace {

using namespace lamp_protocol;

constexpr double poll_us = 10;
constexpr double control_most_ms = 500;
constexpr double reset_ms = 10;

}  // namespace

template <typename Try>
EmulatedHost::Handshake EmulatedHost::retry(double most_ms, Try attempt) {
    const double end = board_.now_us() + most_ms * 1000;
    Handshake result = attempt();
    while (result == Handshake::nak && board_.now_us() < end) {
        board_.run_us(poll_us);
        result = attempt();
    }
    return result;
}

void EmulatedHost::bus_reset() {
    board_.bus_reset();
    board_.run_ms(reset_ms);
}

void EmulatedHost::enumerate() {
    if (!board_.run_until([&] { return board_.attached(); }, 1000)) throw std::runtime_error("the board stays away");
    board_.run_ms(5);
    bus_reset();
    const bool addressed = control({0, 5, 7, 0, 0}).handshake == Handshake::ack;
    board_.run_ms(2);
    if (!addressed || control({0, 9, 1, 0, 0}).handshake != Handshake::ack)
        throw std::runtime_error("the board does not take address and configuration");
    board_.run_ms(1);
}

EmulatedHost::Answer EmulatedHost::control(const ControlRequest& r, const std::vector<std::uint8_t>& data) {
    const auto low = [](std::uint16_t word) { return static_cast<std::uint8_t>(word); };
    const auto high = [](std::uint16_t word) { return static_cast<std::uint8_t>(word >> 8); };
    board_.setup(
        {r.type, r.request, low(r.value), high(r.value), low(r.index), high(r.index), low(r.length), high(r.length)});
    // Silicon drops a stale IN packet at a SETUP; simavr keeps it, so wait until the firmware has seen the SETUP.
    board_.run_until([&] { return !board_.setup_waits(); }, control_most_ms);

    Answer answer;
    std::vector<std::uint8_t> packet;
    const auto get = [&] { return board_.in(0, packet); };
    if ((r.type & 0x80) != 0) {
        do {
            answer.handshake = retry(control_most_ms, get);
            if (answer.handshake != Handshake::ack) return answer;
            answer.bytes.insert(answer.bytes.end(), packet.begin(), packet.end());
        } while (packet.size() == 64 && answer.bytes.size() < r.length);
        answer.handshake = retry(control_most_ms, [&] { return board_.out(0, nullptr, 0); });
        return answer;
    }
    for (std::size_t sent = 0; sent < data.size(); sent += 64) {
        const auto size = static_cast<std::uint32_t>(std::min<std::size_t>(64, data.size() - sent));
        answer.handshake = retry(control_most_ms, [&] { return board_.out(0, data.data() + sent, size); });
        if (answer.handshake != Handshake::ack) return answer;
        board_.run_us(poll_us);
    }
    answer.handshake = retry(control_most_ms, get);
    return answer;
}

EmulatedHost::Handshake EmulatedHost::out(std::uint8_t endpoint, const std::vector<std::uint8_t>& bytes,
                                          double most_ms) {
    return retry(most_ms, [&] { return board_.out(endpoint, bytes.data(), static_cast<std::uint32_t>(bytes.size())); });
}

EmulatedHost::Answer EmulatedHost::in(std::uint8_t endpoint, double most_ms) {
    Answer answer;
    answer.handshake = retry(most_ms, [&] { return board_.in(endpoint, answer.bytes); });
    return answer;
}

std::optional<Event> EmulatedHost::next_event(double most_ms) {
    const Answer answer = in(event_endpoint & 0x0F, most_ms);
    if (answer.handshake != Handshake::ack || answer.bytes.size() != sizeof(Event)) return std::nullopt;
    Event event;
    std::memcpy(&event, answer.bytes.data(), sizeof event);
    return event;
}

Event EmulatedHost::command(Command command, const void* payload, std::size_t size) {
    if (out(command_endpoint, lampctl::packet_of(command, ++sequence_, payload, size)) != Handshake::ack)
        throw std::runtime_error("the board takes no command");
    while (const auto event = next_event(100)) {
        if (event->kind == EventKind::reply && event->sequence == sequence_) return *event;
        events.push_back(*event);
    }
    throw std::runtime_error("the board does not reply");
}

void EmulatedHost::stay_for_ms(double milliseconds) {
    const double end = board_.now_us() + milliseconds * 1000;
    while (board_.now_us() < end) {
        command(Command::heartbeat);
        const double until = std::min(end, board_.now_us() + 20'000);
        while (board_.now_us() < until)
            if (const auto event = next_event(std::max(0.01, (until - board_.now_us()) / 1000)))
                events.push_back(*event);
    }
}

}  // namespace darkbox::test
