#include "rig/description/lamp_section.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "rig/description/dose_section.h"
#include "rig/description/milliseconds.h"

namespace darkbox {
namespace {

constexpr std::size_t longest_name = 64;
constexpr double nearest_lamp_mm = 10;
constexpr double farthest_lamp_mm = 100'000;
constexpr double longest_usb_on_s = 60;

bool is_file_name_character(char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '-' || c == '_' ||
           c == '.';
}

/// Lamp names become part of file names.
bool is_lamp_name(const std::string& name) {
    return !name.empty() && name.size() <= longest_name && name.front() != '.' &&
           std::all_of(name.begin(), name.end(), is_file_name_character);
}

std::array<double, 3> read_position(TomlSection& section) {
    const auto read = section.numbers("position_mm", 3);
    if (!read)
        section.fail("position_mm", "position_mm is missing",
                     "add position_mm = [x, y, z]: x right, y up, z to the camera, from the object");
    const std::array<double, 3> position{(*read)[0], (*read)[1], (*read)[2]};
    const double distance = std::hypot(position[0], position[1], position[2]);
    if (distance < nearest_lamp_mm || distance > farthest_lamp_mm)
        section.fail("position_mm",
                     fmt::format("position_mm is {} mm from the object; allowed: {} to {}", distance, nearest_lamp_mm,
                                 farthest_lamp_mm),
                     "give the position in millimetres, measured from the object");
    return position;
}

std::string read_lamp_name(TomlSection& section) {
    std::string name = section.required_text("name");
    if (!is_lamp_name(name))
        section.fail("name", fmt::format("name '{}' cannot be part of a file name", name.substr(0, longest_name)),
                     fmt::format("use 1 to {} letters, digits, '-', '_' or '.', not starting with '.'", longest_name));
    return name;
}

std::string driver_in_words(const RigDescription& rig) {
    return fmt::format("driver \"{}\"{}", rig.lamps_driver, rig.gpio.multiplexer ? " with a multiplexer" : "");
}

void read_output(TomlSection& section, const RigDescription& rig, bool active_low, LampDescription& lamp) {
    const std::int64_t addresses =
        rig.gpio.multiplexer ? std::int64_t{1} << rig.gpio.multiplexer->address_lines.size() : most_lamps;
    const auto line = section.text_or_digits("line");
    const auto channel = section.integer("channel", {0, static_cast<std::int64_t>(most_lamps) - 1});
    const auto address = section.integer("address", {0, addresses - 1});
    const std::string wanted = output_key(rig);
    for (const char* other : {"channel", "line", "address"})
        if (other != wanted && section.has(other))
            section.fail(other, fmt::format("{} does not belong to {}", other, driver_in_words(rig)),
                         fmt::format("name the lamp's output with {}", wanted));
    if (!section.has(wanted) || (line && line->empty()))
        section.fail(wanted, fmt::format("{} is missing; {} needs it", wanted, driver_in_words(rig)),
                     fmt::format("add {} to the lamp", wanted));
    if (wanted != "line" && section.has("active_low"))
        section.fail("active_low", "active_low belongs to a lamp with a line of its own",
                     "remove it; a decoder's enable line has enable_active_low");
    lamp.line = line.value_or("");
    lamp.active_low = section.flag("active_low").value_or(active_low);
    lamp.channel = static_cast<int>(channel.value_or(-1));
    lamp.address = static_cast<int>(address.value_or(-1));
}

}  // namespace

std::string output_key(const RigDescription& rig) {
    if (rig.lamps_driver != "gpio") return "channel";
    return rig.gpio.multiplexer ? "address" : "line";
}

LampDescription read_lamp(TomlSection& section, const RigDescription& rig, bool active_low) {
    LampDescription lamp;
    std::set<std::string> keys{"name",        "line",     "active_low", "address",  "channel",
                               "position_mm", "max_on_s", "max_duty",   "settle_ms"};
    keys.insert(lamp_dose_keys.begin(), lamp_dose_keys.end());
    section.allow(keys);
    lamp.dose_per_s = read_lamp_dose(section);
    lamp.name = read_lamp_name(section);
    const Seconds exposure = rig.camera.exposure;
    read_output(section, rig, active_low, lamp);
    lamp.position_mm = read_position(section);
    lamp.max_on = Seconds(section.number("max_on_s", {0.001, 600}).value_or(lamp.max_on.count()));
    if (section.has("max_duty") && rig.lamps_driver != "usb")
        section.fail("max_duty", fmt::format("max_duty does not belong to driver \"{}\"", rig.lamps_driver),
                     "leave it out: only the USB lamp controller keeps to it");
    lamp.max_duty = section.number("max_duty", {0.02, 0.79}).value_or(lamp.max_duty);
    if (rig.lamps_driver == "usb" && lamp.max_on.count() > longest_usb_on_s)
        section.fail(
            "max_on_s",
            fmt::format("max_on_s is {}; allowed with driver \"usb\": up to {}", lamp.max_on.count(), longest_usb_on_s),
            "lower max_on_s: the USB lamp controller lets no lamp shine longer");
    lamp.settle = milliseconds(section.number("settle_ms", {0, 10'000}).value_or(as_milliseconds(lamp.settle)));
    if (lamp.max_on <= lamp.settle + exposure)
        section.fail("max_on_s",
                     fmt::format("max_on_s is {}; allowed: more than settle_ms and exposure_ms together ({} ms)",
                                 lamp.max_on.count(), as_milliseconds(lamp.settle + exposure)),
                     "raise max_on_s, or shorten exposure_ms of [camera]");
    return lamp;
}

}  // namespace darkbox
