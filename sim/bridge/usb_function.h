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

/// What a device says of itself.
struct UsbDescriptors {
    UsbBytes device;
    UsbBytes configuration;            ///< with all that belongs to it
    std::vector<std::string> strings;  ///< string descriptor 1 and following, ASCII
};

/// A USB device's own part: what its port does not do for every device. Thread-compatible.
class UsbFunction {
public:
    virtual ~UsbFunction() = default;
    virtual const UsbDescriptors& descriptors() const = 0;
    /// A request of a class or a vendor. `data` is what the host sent; the answer goes to the host where the request
    /// asks for one. No value: the request is stalled.
    virtual std::optional<UsbBytes> control(const UsbRequest& request, std::span<const std::uint8_t> data) = 0;
};

}  // namespace darkbox::sim
