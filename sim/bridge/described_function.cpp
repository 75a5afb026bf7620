#include "sim/bridge/described_function.h"

namespace darkbox::sim {
namespace {

constexpr std::uint8_t get_status = 0, set_feature = 3, clear_feature = 1, get_descriptor = 6, get_configuration = 8,
                       set_configuration = 9, set_interface = 11;
constexpr std::uint8_t type_mask = 0x60;

}  // namespace

std::optional<UsbBytes> DescribedFunction::control(const UsbRequest& request, std::span<const std::uint8_t> data) {
    return (request.type & type_mask) == 0 ? standard_request(request) : own_request(request, data);
}

std::optional<UsbBytes> DescribedFunction::standard_request(const UsbRequest& request) {
    switch (request.request) {
        case get_descriptor:
            return descriptor(request);
        case get_status:
            return UsbBytes{0, 0};
        case get_configuration:
            return UsbBytes{configuration_};
        case set_configuration:
            configuration_ = static_cast<std::uint8_t>(request.value);
            return UsbBytes{};
        case set_interface:
        case set_feature:
        case clear_feature:
            return UsbBytes{};
        default:
            return std::nullopt;
    }
}

/// USB 2.0, 9.4.3 and 9.6.
std::optional<UsbBytes> DescribedFunction::descriptor(const UsbRequest& request) const {
    constexpr std::uint8_t device = 1, configuration = 2, string = 3;
    const unsigned type = request.value >> 8U, index = request.value & 255U;
    if (type == device) return descriptors_.device;
    if (type == configuration && index == 0) return descriptors_.configuration;
    if (type != string || index > descriptors_.strings.size()) return std::nullopt;
    if (index == 0) return UsbBytes{4, string, 0x09, 0x04};  // English
    const std::string& text = descriptors_.strings[index - 1];
    UsbBytes bytes{static_cast<std::uint8_t>(2 + 2 * text.size()), string};
    for (const char c : text) bytes.insert(bytes.end(), {static_cast<std::uint8_t>(c), 0});
    return bytes;
}

}  // namespace darkbox::sim
