#include "rig/lamps/gpio_lamps.h"

#include <fmt/format.h>

#include <stdexcept>

#include "acquisition/device/device_error.h"

namespace darkbox {

GpioRequest gpio_request(const RigDescription& rig) {
    GpioRequest request{.chip = rig.gpio.chip, .lines = {}};
    if (rig.gpio.multiplexer) {
        const MultiplexerDescription& decoder = *rig.gpio.multiplexer;
        request.lines.push_back({decoder.enable_line, decoder.enable_active_low});
        for (const std::string& line : decoder.address_lines) request.lines.push_back({line, false});
    } else {
        for (const LampDescription& lamp : rig.lamps) request.lines.push_back({lamp.line, lamp.active_low});
    }
    return request;
}

GpioLamps::GpioLamps(const RigDescription& rig, LampGuardian& guardian) : guardian_(guardian) {
    for (std::size_t i = 0; i < rig.lamps.size(); ++i) {
        const LampDescription& lamp = rig.lamps[i];
        Output output{.address = 0, .on = std::uint64_t{1} << i, .max_on = to_nanoseconds(lamp.max_on)};
        if (rig.gpio.multiplexer) {
            constexpr std::uint64_t enable = 1;
            output.address = static_cast<std::uint64_t>(lamp.address) << 1;
            output.on = output.address | enable;
        }
        lamps_.push_back(output);
    }
    guardian_.open();
}

GpioLamps::~GpioLamps() {
    try {
        dark();
    } catch (...) {  // NOLINT(bugprone-empty-catch): the guardian darkens them once it hears nothing
    }
}

std::vector<std::uint64_t> GpioLamps::steps_to_dark() const {
    return lit_ ? std::vector{lamps_.at(lit_->value).address} : std::vector<std::uint64_t>{};
}

void GpioLamps::light(LampId lamp, double level) {
    if (lamp.value >= lamps_.size())
        throw std::invalid_argument(fmt::format("lamp {} of {}", lamp.value, lamps_.size()));
    if (level != 1.0) throw std::invalid_argument(fmt::format("level {}: a GPIO lamp knows 1 alone", level));
    const Output& output = lamps_[lamp.value];
    std::vector<std::uint64_t> steps;
    if (lit_ != lamp) {
        steps = steps_to_dark();
        steps.push_back(output.address);
    }
    steps.push_back(output.on);
    guardian_.drive(steps, output.max_on);
    lit_ = lamp;
}

void GpioLamps::dark() {
    try {
        guardian_.darken(steps_to_dark());
    } catch (const DeviceError&) {
        guardian_.open();  // a chip that was unplugged and came back
    }
    lit_.reset();
}

LampHealth GpioLamps::health() {
    try {
        guardian_.report();
        return {};
    } catch (const Error& error) {
        return {.reachable = false, .problems = {error.what()}};
    }
}

}  // namespace darkbox
