#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace darkbox::sim {

/// The eight bytes of a control transfer's setup packet (USB 2.0, 9.3).
struct UsbRequest {
    std::uint8_t type = 0;
    std::uint8_t request = 0;
    std::uint16_t value = 0;
    std::uint16_t index = 0;
    std::uint16_t length = 0;
};

using UsbBytes = std::vector<std::uint8_t>;

/// As the kernel numbers them (enum usb_device_speed).
enum class UsbSpeed { full = 2, high = 3 };

/// A USB device behind its port. Thread-compatible.
class UsbFunction {
public:
    virtual ~UsbFunction() = default;
    virtual UsbSpeed speed() const = 0;
    /// A request to endpoint 0, of whatever kind. `data` is what the host sent; the answer goes to the host where the
    /// request asks for one. No value: the request is stalled.
    virtual std::optional<UsbBytes> control(const UsbRequest& request, std::span<const std::uint8_t> data) = 0;
};

}  // namespace darkbox::sim
