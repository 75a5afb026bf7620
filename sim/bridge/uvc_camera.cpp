#include "sim/bridge/uvc_camera.h"

#include <algorithm>
#include <cmath>

namespace darkbox::sim {
namespace {

// Names and numbers: USB Device Class Definition for Video Devices 1.1, appendix A.
constexpr std::uint8_t video_class = 0x0e, video_control = 1, video_streaming = 2, interface_collection = 3;
constexpr std::uint8_t cs_interface = 0x24;
constexpr std::uint8_t camera_terminal = 1, processing_unit = 2, output_terminal = 3;
constexpr std::uint8_t ae_mode = 2, exposure_absolute = 4, gain_selector = 4;
constexpr std::uint8_t control_interface = 0, streaming_interface = 1;
constexpr std::uint8_t set_cur = 0x01, get_cur = 0x81, get_min = 0x82, get_max = 0x83, get_res = 0x84, get_len = 0x85,
                       get_info = 0x86, get_def = 0x87;
constexpr std::uint8_t can_get_and_set = 3;
constexpr std::int32_t manual_mode = 1, aperture_priority = 8;
constexpr double exposure_unit_s = 100e-6;
constexpr std::uint32_t clock_hz = 48'000'000;

UsbBytes& operator+=(UsbBytes& bytes, const UsbBytes& more) {
    bytes.insert(bytes.end(), more.begin(), more.end());
    return bytes;
}

/// Little-endian, as all of USB.
UsbBytes number(std::uint32_t value, int bytes) {
    UsbBytes result;
    for (int i = 0; i < bytes; ++i) result.push_back(static_cast<std::uint8_t>(value >> (8 * i)));
    return result;
}

/// With its length in front.
UsbBytes sized(const UsbBytes& content) {
    UsbBytes result{static_cast<std::uint8_t>(content.size() + 1)};
    return result += content;
}

UsbBytes join(std::initializer_list<UsbBytes> parts) {
    UsbBytes all;
    for (const UsbBytes& part : parts) all += part;
    return all;
}

UsbBytes interface(std::uint8_t which, std::uint8_t endpoints, std::uint8_t subclass) {
    return sized({4, which, 0, endpoints, video_class, subclass, 0, 0});
}

/// 3.7.2: camera terminal with exposure mode and time, then gain, then the way out.
UsbBytes control_descriptors() {
    const UsbBytes units = join({
        sized(join({{cs_interface, 2, camera_terminal}, number(0x0201, 2), {0, 0, 0, 0, 0, 0, 0, 0}, {3, 0x0a, 0, 0}})),
        sized({cs_interface, 5, processing_unit, camera_terminal, 0, 0, 2, 0x00, 0x02, 0, 0}),
        sized(join({{cs_interface, 3, output_terminal}, number(0x0101, 2), {0, processing_unit, 0}})),
    });
    constexpr std::uint32_t header_size = 13;
    return join({sized(join({{cs_interface, 1},
                             number(0x0110, 2),
                             number(static_cast<std::uint32_t>(header_size + units.size()), 2),
                             number(clock_hz, 4),
                             {1, streaming_interface}})),
                 units});
}

std::uint32_t frame_bytes(const UvcCamera::Mode& mode) {
    return static_cast<std::uint32_t>(mode.width * mode.height * 2);
}
std::uint32_t interval(const UvcCamera::Mode& mode) {
    return static_cast<std::uint32_t>(std::lround(mode.period.count() * 1e7));
}

UsbBytes streaming_descriptors(const UvcCamera::Mode& mode) {
    const UsbBytes y16{'Y', '1', '6', ' ', 0, 0, 0x10, 0, 0x80, 0, 0, 0xaa, 0, 0x38, 0x9b, 0x71};
    const auto bit_rate = static_cast<std::uint32_t>(frame_bytes(mode) * 8 / mode.period.count());
    const UsbBytes formats = join({
        sized(join({{cs_interface, 4, 1, 1}, y16, {16, 1, 0, 0, 0, 0}})),
        sized(join({{cs_interface, 5, 1, 0},
                    number(static_cast<std::uint32_t>(mode.width), 2),
                    number(static_cast<std::uint32_t>(mode.height), 2),
                    number(bit_rate, 4),
                    number(bit_rate, 4),
                    number(frame_bytes(mode), 4),
                    number(interval(mode), 4),
                    {1},
                    number(interval(mode), 4)})),
    });
    constexpr std::uint32_t header_size = 14;
    return join({sized(join({{cs_interface, 1, 1},
                             number(static_cast<std::uint32_t>(header_size + formats.size()), 2),
                             {UvcCamera::stream_endpoint, 0, output_terminal, 0, 0, 0, 1, 0}})),
                 formats});
}

UsbDescriptors describe(const UvcCamera::Mode& mode, const std::string& serial) {
    UsbDescriptors result;
    result.strings = {"darkbox", "Digital twin", serial};
    // Vendor 0x1209: pid.codes; products 1 to 16 are for tests, and the lamp controller has 1.
    result.device = sized(join(
        {{1}, number(0x0200, 2), {0xef, 2, 1, 64}, number(0x1209, 2), number(2, 2), number(0x0100, 2), {1, 2, 3, 1}}));
    const UsbBytes content = join({
        sized({11, control_interface, 2, video_class, interface_collection, 0, 0}),
        interface(control_interface, 0, video_control),
        control_descriptors(),
        interface(streaming_interface, 1, video_streaming),
        streaming_descriptors(mode),
        sized(join({{5, UvcCamera::stream_endpoint, 2}, number(512, 2), {0}})),
    });
    constexpr std::uint32_t header_size = 9;
    result.configuration = join(
        {sized(join({{2}, number(static_cast<std::uint32_t>(header_size + content.size()), 2), {2, 1, 0, 0x80, 50}})),
         content});
    return result;
}

std::int32_t value_of(std::span<const std::uint8_t> data) {
    std::uint32_t value = 0;
    for (std::size_t i = 0; i < data.size(); ++i) value |= static_cast<std::uint32_t>(data[i]) << (8 * i);
    return static_cast<std::int32_t>(value);
}

}  // namespace

UvcCamera::UvcCamera(const Mode& mode, const std::string& serial)
    : DescribedFunction(describe(mode, serial)),
      mode_(mode),
      controls_{Control{camera_terminal, ae_mode, 1, 1, 8, manual_mode | aperture_priority, aperture_priority,
                        aperture_priority},
                Control{camera_terminal, exposure_absolute, 4, 1, 10'000, 1, 156, 156},
                Control{processing_unit, gain_selector, 2, lowest_gain, 160, 1, 40, 40}} {}

bool UvcCamera::is_automatic() const { return controls_[0].value != manual_mode; }
Seconds UvcCamera::exposure() const { return Seconds(controls_[1].value * exposure_unit_s); }
double UvcCamera::gain() const { return static_cast<double>(controls_[2].value) / lowest_gain; }

std::optional<UsbBytes> UvcCamera::own_request(const UsbRequest& request, std::span<const std::uint8_t> data) {
    constexpr std::uint8_t of_a_class_to_an_interface = 0x21;
    if ((request.type & 0x7fU) != of_a_class_to_an_interface) return std::nullopt;
    return (request.index & 255U) == streaming_interface ? streaming_request(request) : control_request(request, data);
}

/// Probe and commit (4.3.1.1): there is but one stream to agree on.
std::optional<UsbBytes> UvcCamera::streaming_request(const UsbRequest& request) const {
    const unsigned selector = request.value >> 8U;
    if (selector != 1 && selector != 2) return std::nullopt;
    if (request.request == get_info) return UsbBytes{can_get_and_set};
    const UsbBytes stream = agreed_stream();
    if (request.request == get_len) return number(static_cast<std::uint32_t>(stream.size()), 2);
    return stream;
}

UsbBytes UvcCamera::agreed_stream() const {
    return join({{0, 0, 1, 1},
                 number(interval(mode_), 4),
                 UsbBytes(10, 0),
                 number(frame_bytes(mode_), 4),
                 number(largest_payload, 4),
                 number(clock_hz, 4),
                 {3, 0, 0, 0}});
}

std::optional<UsbBytes> UvcCamera::control_request(const UsbRequest& request, std::span<const std::uint8_t> data) {
    const auto found = std::find_if(controls_.begin(), controls_.end(), [&](const Control& c) {
        return c.entity == request.index >> 8U && c.selector == request.value >> 8U;
    });
    if (found == controls_.end()) return std::nullopt;
    const auto as_bytes = [&](std::int32_t value) { return number(static_cast<std::uint32_t>(value), found->size); };
    switch (request.request) {
        case set_cur: {
            const std::int32_t value = value_of(data);
            if (data.size() != found->size || value < found->least || value > found->most) return std::nullopt;
            found->value = value;
            return UsbBytes{};
        }
        case get_cur:
            return as_bytes(found->value);
        case get_min:
            return as_bytes(found->least);
        case get_max:
            return as_bytes(found->most);
        case get_res:
            return as_bytes(found->step);
        case get_def:
            return as_bytes(found->at_power_on);
        case get_len:
            return number(found->size, 2);
        case get_info:
            return UsbBytes{can_get_and_set};
        default:
            return std::nullopt;
    }
}

std::array<std::uint8_t, 2> UvcCamera::bytes(const PayloadHeader& header) {
    constexpr unsigned frame_id = 1, end_of_frame = 2, error = 0x40, end_of_header = 0x80;
    const unsigned flags = end_of_header | (header.odd_frame ? frame_id : 0) | (header.last ? end_of_frame : 0) |
                           (header.error ? error : 0);
    return {2, static_cast<std::uint8_t>(flags)};
}

}  // namespace darkbox::sim
