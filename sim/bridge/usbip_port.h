#pragma once

#include <cstdint>
#include <deque>
#include <span>

#include "acquisition/device/clock.h"
#include "acquisition/device/unique_fd.h"
#include "sim/bridge/usb_function.h"

namespace darkbox::sim {

/// A transfer that the host waits for, other than to endpoint 0.
struct UsbTransfer {
    std::uint32_t id = 0;       ///< of its port
    std::uint8_t endpoint = 0;  ///< with its direction bit
    std::uint32_t length = 0;   ///< bytes that the host has, or takes
    UsbBytes data;              ///< what it has
};

/// A port of the kernel's virtual USB host (vhci_hcd) with a device in it: from the constructor on the kernel sees the
/// device as plugged in, from the destructor on as unplugged. Speaks USB/IP (Linux' Documentation/usb/usbip_protocol)
/// over a pair of sockets. Transfers to and from its endpoints end when finish() is called. Thread-compatible.
class UsbIpPort {
public:
    /// `port`: 0 to 7. Needs the module vhci-hcd and root. `function` and `clock` must outlive this. Throws
    /// DeviceError.
    UsbIpPort(UsbFunction& function, Clock& clock, int port);

    /// Answers the host until this moment, or until the host is gone.
    void serve(TimePoint until);
    /// As serve(), but ends as soon as the host waits for a transfer of this endpoint.
    void serve_until_waiting(std::uint8_t endpoint, TimePoint until);
    /// Whether the host waits for a transfer of this endpoint.
    bool is_waiting(std::uint8_t endpoint) const;
    /// What the host waits for, the oldest first; what it took back is gone from here.
    const std::deque<UsbTransfer>& waiting() const { return waiting_; }
    /// Ends one of them with 0 and the bytes that went, or a negative number of an error.
    void finish(std::uint32_t id, int error, std::span<const std::uint8_t> data);
    /// Ends the oldest that the host waits for from this endpoint, which must be one.
    void complete(std::uint8_t endpoint, std::span<const std::uint8_t> data);
    bool host_is_gone() const { return gone_; }

private:
    struct Header;

    bool wait_for_host(TimePoint until);
    void serve_one();
    void submit(const Header& header);
    void unlink(const Header& header);
    void control(const Header& header, std::span<const std::uint8_t> data);
    void reply(std::uint32_t sequence, int status, std::uint32_t length, std::span<const std::uint8_t> data);
    bool receive(void* bytes, std::size_t size);
    void send(std::span<const std::uint8_t> bytes);

    UsbFunction& function_;
    Clock& clock_;
    UniqueFd socket_;
    bool gone_ = false;
    std::deque<UsbTransfer> waiting_;
};

}  // namespace darkbox::sim
