#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <span>

#include "acquisition/device/clock.h"
#include "acquisition/device/unique_fd.h"
#include "sim/bridge/usb_function.h"

namespace darkbox::sim {

/// A port of the kernel's virtual USB host (vhci_hcd) with a device in it: from the constructor on the kernel sees the
/// device as plugged in, from the destructor on as unplugged. Speaks USB/IP (Linux' Documentation/usb/usbip_protocol)
/// over a pair of sockets. Transfers to the host are answered when complete() is called; others than control transfers
/// to the device are stalled. Thread-compatible.
class UsbIpPort {
public:
    /// High speed. `port`: 0 to 7. Needs the module vhci-hcd and root. `function` and `clock` must outlive this.
    /// Throws DeviceError.
    UsbIpPort(UsbFunction& function, Clock& clock, int port);

    /// Answers the host until this moment, or until the host is gone.
    void serve(TimePoint until);
    /// As serve(), but ends as soon as the host waits for a transfer from this endpoint.
    void serve_until_waiting(std::uint8_t endpoint, TimePoint until);
    /// Whether the host waits for a transfer from this endpoint.
    bool is_waiting(std::uint8_t endpoint) const;
    /// Ends the oldest transfer that the host waits for; it must be one.
    void complete(std::uint8_t endpoint, std::span<const std::uint8_t> data);
    bool host_is_gone() const { return gone_; }

private:
    struct Header;
    struct Transfer {
        std::uint32_t sequence = 0;
        std::uint32_t length = 0;
    };

    bool wait_for_host(TimePoint until);
    void serve_one();
    void submit(const Header& header);
    void unlink(const Header& header);
    void control(const Header& header, std::span<const std::uint8_t> data);
    std::optional<UsbBytes> standard_request(const UsbRequest& request);
    std::optional<UsbBytes> descriptor(const UsbRequest& request) const;
    void reply(std::uint32_t sequence, int status, std::uint32_t length, std::span<const std::uint8_t> data);
    bool receive(void* bytes, std::size_t size);
    void send(std::span<const std::uint8_t> bytes);

    UsbFunction& function_;
    Clock& clock_;
    UniqueFd socket_;
    bool gone_ = false;
    std::uint8_t configuration_ = 0;
    std::map<std::uint8_t, std::deque<Transfer>> waiting_;  ///< by endpoint
};

}  // namespace darkbox::sim
