#pragma once

#include <cstdint>
#include <span>

#include "acquisition/frame/units.h"
#include "sim/bridge/described_function.h"

namespace darkbox::sim {

/// The USB side of a camera of the USB video class 1.1 ("UVC"): one picture format, Y16 in one size and rate, streamed
/// by bulk transfers, with exposure mode, exposure time and gain as controls. It powers on in automatic exposure, as
/// cameras do. Thread-compatible.
class UvcCamera final : public DescribedFunction {
public:
    static constexpr std::uint8_t stream_endpoint = 0x82;  ///< to the host
    static constexpr std::size_t largest_payload = 16384;  ///< bytes of one transfer, header included
    static constexpr int lowest_gain = 10;                 ///< control value of gain 1

    struct Mode {
        int width = 320;
        int height = 240;
        Seconds period{0.25};
    };
    UvcCamera(const Mode& mode, const std::string& serial);

    bool is_automatic() const;
    Seconds exposure() const;
    double gain() const;

    /// The header of a payload (UVC 1.1, 2.4.3.3).
    struct PayloadHeader {
        bool odd_frame = false;  ///< changes with every frame
        bool last = false;       ///< of its frame
        bool error = false;
    };
    static std::array<std::uint8_t, 2> bytes(const PayloadHeader& header);

protected:
    std::optional<UsbBytes> own_request(const UsbRequest& request, std::span<const std::uint8_t> data) override;

private:
    struct Control {
        std::uint8_t entity;  ///< terminal or unit
        std::uint8_t selector;
        std::uint8_t size;  ///< bytes
        std::int32_t least, most, step, at_power_on;
        std::int32_t value;
    };

    std::optional<UsbBytes> streaming_request(const UsbRequest& request) const;
    std::optional<UsbBytes> control_request(const UsbRequest& request, std::span<const std::uint8_t> data);
    UsbBytes agreed_stream() const;

    Mode mode_;
    std::array<Control, 3> controls_;
};

}  // namespace darkbox::sim
