#include "rig/description/usb_section.h"

#include <fmt/format.h>

#include "rig/description/milliseconds.h"

namespace darkbox {
namespace {

constexpr std::size_t longest_usb_serial = 12;

}  // namespace

UsbDescription read_usb(TomlSection& section) {
    section.allow({"serial", "heartbeat_ms"});
    UsbDescription usb;
    usb.serial = section.text("serial").value_or("");
    if (usb.serial.size() > longest_usb_serial)
        section.fail("serial",
                     fmt::format("serial has {} characters; allowed: up to {}", usb.serial.size(), longest_usb_serial),
                     "darkbox lamps list --boards lists the serials of the lamp controllers");
    usb.heartbeat = milliseconds(section.number("heartbeat_ms", {50, 1000}).value_or(as_milliseconds(usb.heartbeat)));
    return usb;
}

}  // namespace darkbox
