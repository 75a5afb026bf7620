#pragma once

#include "sim/bridge/usb_function.h"

namespace darkbox::sim {

/// What a device says of itself.
struct UsbDescriptors {
    UsbBytes device;
    UsbBytes configuration;            ///< with all that belongs to it
    std::vector<std::string> strings;  ///< string descriptor 1 and following, ASCII
};

/// A device of high speed that answers from its descriptors what every device is asked; its own requests are for a
/// class that derives from this. Thread-compatible.
class DescribedFunction : public UsbFunction {
public:
    UsbSpeed speed() const override { return UsbSpeed::high; }
    std::optional<UsbBytes> control(const UsbRequest& request, std::span<const std::uint8_t> data) final;

protected:
    explicit DescribedFunction(UsbDescriptors descriptors) : descriptors_(std::move(descriptors)) {}

    /// A request of a class or a vendor; as control().
    virtual std::optional<UsbBytes> own_request(const UsbRequest& request, std::span<const std::uint8_t> data) = 0;

private:
    std::optional<UsbBytes> standard_request(const UsbRequest& request);
    std::optional<UsbBytes> descriptor(const UsbRequest& request) const;

    UsbDescriptors descriptors_;
    std::uint8_t configuration_ = 0;
};

}  // namespace darkbox::sim
