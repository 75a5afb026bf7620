#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include "firmware/lampctl/controller.h"

namespace darkbox::lampctl {

/// The controller's core on the host, in time of its own: what tests and the fuzzer drive. It calls the core as the
/// boards do: a tick each millisecond, a reading of the thermistor with it, and deadlines at their microsecond.
/// Thread-compatible.
class HostBoard final : private Outputs {
public:
    /// A valid identity of 64 lamps, two of them lit at most, 5 s at most.
    static lamp_protocol::Identity some_identity();

    explicit HostBoard(const lamp_protocol::Identity& identity = some_identity());
    HostBoard(const HostBoard&) = delete;
    HostBoard& operator=(const HostBoard&) = delete;

    /// A packet as it came from the bus.
    void receive(const std::vector<std::uint8_t>& packet);
    /// A command with the right CRC, and the reply to it; events that came before stay in `events`.
    lamp_protocol::Event command(lamp_protocol::Command command, const void* payload = nullptr, std::size_t size = 0);
    template <typename Payload>
    lamp_protocol::Event command(lamp_protocol::Command name, const Payload& payload) {
        return command(name, &payload, sizeof payload);
    }
    void run_us(std::uint64_t microseconds);
    void run_ms(std::uint64_t milliseconds) { run_us(milliseconds * 1000); }
    void strobe() { controller_.strobe(clock_us()); }
    void host_gone() { controller_.host_gone(clock_us()); }
    void identify(const lamp_protocol::Identity& identity) { controller_.identify(identity); }
    void dark() { controller_.dark(); }

    lamp_protocol::Status status() const { return controller_.status(clock_us()); }
    std::uint64_t now_us() const { return now_us_; }
    const LampSet& lit() const { return lit_; }
    std::uint8_t level() const { return level_; }
    bool triggered() const { return triggered_; }
    /// Moves the events that wait into `events`, as a host does that polls.
    void fetch_events();

    std::uint16_t thermistor = 512;
    std::vector<lamp_protocol::Event> events;
    std::function<void(const LampSet&, std::uint8_t level)> on_show;
    std::function<void(bool)> on_trigger;

private:
    void show(const LampSet& lamps, std::uint8_t level) override;
    void trigger(bool active) override;
    /// The board's clock wraps. It starts shortly before it does.
    std::uint32_t clock_us() const { return static_cast<std::uint32_t>(now_us_ + start_us); }

    static constexpr std::uint64_t start_us = 0xFFFF'0000;
    Controller controller_{*this};
    std::uint64_t now_us_ = 0;
    std::uint64_t next_tick_us_ = 1000;
    std::uint8_t sequence_ = 0;
    LampSet lit_;
    std::uint8_t level_ = 0;
    bool triggered_ = false;
};

/// A packet with its CRC.
std::vector<std::uint8_t> packet_of(lamp_protocol::Command command, std::uint8_t sequence, const void* payload,
                                    std::size_t size);

/// `identity` with its CRC made right.
lamp_protocol::Identity sealed(lamp_protocol::Identity identity);

}  // namespace darkbox::lampctl
