#include "rig/description/gpio_section.h"

#include <fmt/format.h>

#include <algorithm>

namespace darkbox {
namespace {

constexpr std::size_t most_address_lines = 6;

MultiplexerDescription read_multiplexer(TomlSection& section) {
    MultiplexerDescription decoder;
    section.allow({"address_lines", "enable_line", "enable_active_low"});
    decoder.address_lines = section.texts_or_digits("address_lines");
    if (decoder.address_lines.empty() || decoder.address_lines.size() > most_address_lines)
        section.fail("address_lines",
                     fmt::format("address_lines names {} lines; allowed: 1 to {}", decoder.address_lines.size(),
                                 most_address_lines),
                     "name the decoder's address lines, lowest bit first");
    decoder.enable_line = section.text_or_digits("enable_line").value_or("");
    if (decoder.enable_line.empty())
        section.fail("enable_line", "enable_line is missing; without it some lamp is always lit",
                     "wire the decoder's enable input to a line and name it");
    std::vector<std::string> lines = decoder.address_lines;
    lines.push_back(decoder.enable_line);
    std::sort(lines.begin(), lines.end());
    const auto twice = std::adjacent_find(lines.begin(), lines.end());
    if (twice != lines.end())
        section.fail("address_lines", fmt::format("line '{}' is named twice", *twice),
                     "give every input of the decoder a line of its own");
    decoder.enable_active_low = section.flag("enable_active_low").value_or(false);
    return decoder;
}

}  // namespace

bool read_gpio(TomlSection& section, GpioDescription& gpio) {
    section.allow({"chip", "active_low", "multiplexer"});
    gpio.chip = section.required_text("chip");
    if (auto decoder = section.section("multiplexer", "[lamps.gpio.multiplexer]")) {
        gpio.multiplexer = read_multiplexer(*decoder);
        if (section.has("active_low"))
            section.fail("active_low", "active_low is for lamps with lines of their own",
                         "remove it; a decoder's enable line has enable_active_low");
    }
    return section.flag("active_low").value_or(false);
}

}  // namespace darkbox
