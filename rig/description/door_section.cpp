#include "rig/description/door_section.h"

#include <fmt/format.h>

namespace darkbox {

DoorDescription read_door(TomlSection& section, const RigDescription& rig) {
    section.allow({"chip", "line", "active_low"});
    DoorDescription door;
    const bool simulated = rig.camera.driver == "sim";
    for (const char* key : {"chip", "line", "active_low"})
        if (simulated && section.has(key))
            section.fail(key, fmt::format("{} does not belong to a simulated rig's door", key),
                         "leave it out: [sim] faults opens the door");
    door.chip = section.text("chip").value_or(rig.gpio.chip);
    door.line = section.text_or_digits("line").value_or("");
    door.active_low = section.flag("active_low").value_or(false);
    if (!simulated && door.chip.empty())
        section.fail("chip", "chip is missing", "give the GPIO chip's label (gpiodetect lists the labels)");
    if (!simulated && door.line.empty())
        section.fail("line", "line is missing", "name the line that the door's switch hangs on");
    return door;
}

}  // namespace darkbox
