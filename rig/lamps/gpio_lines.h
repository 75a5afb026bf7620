#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

namespace darkbox {

/// One line of a GPIO chip, driven by us.
struct GpioLine {
    std::string line;         ///< its name, or its offset in digits
    bool active_low = false;  ///< active means electrically low

    bool operator==(const GpioLine&) const = default;
};

/// What is asked of the kernel: lines of one chip, in this order.
struct GpioRequest {
    std::string chip;  ///< the chip's label, as `gpiodetect` shows it: numbers of chips change, labels do not
    std::vector<GpioLine> lines;

    bool operator==(const GpioRequest&) const = default;
};

/// Lines held as outputs until the destructor releases them. What a released line does is up to the chip, so whoever
/// wants darkness holds on to it. Thread-compatible.
class OutputLines {
public:
    virtual ~OutputLines() = default;
    /// One value for each line of the request, true = active. Throws DeviceError, also when the chip is gone.
    virtual void set(const std::vector<bool>& active) = 0;
};

/// Requests the lines, every one inactive. Throws DeviceError that names the chip or line and says what to do: no such
/// chip (and which there are), no such line, a line that another program holds (and which one).
using RequestLines = std::function<std::unique_ptr<OutputLines>(const GpioRequest&)>;

/// RequestLines of the kernel's GPIO chips, by libgpiod 1.6 or 2.
std::unique_ptr<OutputLines> request_gpio_lines(const GpioRequest& request);

/// One line held as an input until the destructor releases it. Thread-compatible.
class InputLine {
public:
    virtual ~InputLine() = default;
    /// Throws DeviceError, also when the chip is gone.
    virtual bool active() = 0;
};

/// Requests the line of the chip with this label. Throws as RequestLines does.
using RequestInput = std::function<std::unique_ptr<InputLine>(const std::string& chip, const GpioLine& line)>;

/// RequestInput of the kernel's GPIO chips.
std::unique_ptr<InputLine> request_gpio_input(const std::string& chip, const GpioLine& line);

}  // namespace darkbox
