#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <vector>

#include "firmware/protocol/lamp_protocol.h"
#include "rig/lamps/usb_bus.h"

namespace darkbox {

/// The transfers of one open board: requests and commands with deadlines, and the events that come by themselves. All
/// are asynchronous transfers of libusb, so a board that hangs costs its caller the deadline and no more. Thread-safe.
class UsbLink {
public:
    /// Gets each packet of the event endpoint, on the bus's thread; must not call the link.
    using OnPacket = std::function<void(std::span<const std::uint8_t>)>;

    UsbLink(UsbBus::Handle handle, OnPacket on_packet);
    UsbLink(const UsbLink&) = delete;
    UsbLink& operator=(const UsbLink&) = delete;
    /// Takes back what is under way, and waits for it.
    ~UsbLink();

    std::vector<std::uint8_t> read(lamp_protocol::Request request, std::size_t size, Nanoseconds patience);
    void write(lamp_protocol::Request request, std::uint16_t value, std::span<const std::uint8_t> data,
               Nanoseconds patience);
    void send(std::span<const std::uint8_t> packet, Nanoseconds patience);

    /// After a stall: both endpoints are cleared, and events are listened for again.
    void clear_halts();
    /// Whether the board was unplugged, or its events cannot be had any more.
    bool gone() const { return gone_; }
    /// Whether the event endpoint stalled: no event comes until clear_halts().
    bool stalled() const { return stalled_; }

private:
    struct Listener;

    UsbBus::Handle handle_;
    OnPacket on_packet_;
    std::atomic<bool> gone_{false};
    std::atomic<bool> stalled_{false};
    std::unique_ptr<Listener> listener_;
};

}  // namespace darkbox
