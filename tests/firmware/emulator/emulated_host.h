#pragma once

#include <cstring>
#include <optional>
#include <vector>

#include "tests/firmware/emulator/emulated_board.h"

namespace darkbox::test {

struct ControlRequest {
    std::uint8_t type = 0;
    std::uint8_t request = 0;
    std::uint16_t value = 0;
    std::uint16_t index = 0;
    std::uint16_t length = 0;
};

/// A USB host for the emulated board: transfers in the chip's time, polled each 10 us as a bus would.
class EmulatedHost {
public:
    using Handshake = EmulatedBoard::Handshake;
    static constexpr std::uint8_t vendor_in = 0xC0, vendor_out = 0x40;

    explicit EmulatedHost(EmulatedBoard& board) : board_(board) {}

    /// Waits for the board, resets the bus, gives an address and the configuration.
    void enumerate();
    void bus_reset();

    struct Answer {
        Handshake handshake = Handshake::ack;  ///< of the stage that ended it; nak: the board let the time pass
        std::vector<std::uint8_t> bytes;
    };
    Answer control(const ControlRequest& request, const std::vector<std::uint8_t>& data = {});
    Handshake out(std::uint8_t endpoint, const std::vector<std::uint8_t>& bytes, double most_ms = 100);
    /// nak when nothing came.
    Answer in(std::uint8_t endpoint, double most_ms);

    template <typename T>
    T read(lamp_protocol::Request request) {
        const Answer answer =
            control({vendor_in, static_cast<std::uint8_t>(request), 0, 0, static_cast<std::uint16_t>(sizeof(T))});
        if (answer.bytes.size() != sizeof(T)) throw std::runtime_error("the board gave no answer");
        T value;
        std::memcpy(&value, answer.bytes.data(), sizeof value);
        return value;
    }
    lamp_protocol::Status status() { return read<lamp_protocol::Status>(lamp_protocol::Request::status); }

    std::optional<lamp_protocol::Event> next_event(double most_ms);
    /// Sends it and returns its reply; other events go to `events`.
    lamp_protocol::Event command(lamp_protocol::Command command, const void* payload = nullptr, std::size_t size = 0);
    template <typename Payload>
    lamp_protocol::Event command(lamp_protocol::Command name, const Payload& payload) {
        return command(name, &payload, sizeof payload);
    }
    /// Lets this time pass, with a heartbeat each 20 ms.
    void stay_for_ms(double milliseconds);

    std::vector<lamp_protocol::Event> events;

private:
    template <typename Try>
    Handshake retry(double most_ms, Try attempt);

    EmulatedBoard& board_;
    std::uint8_t sequence_ = 0;
};

}  // namespace darkbox::test
