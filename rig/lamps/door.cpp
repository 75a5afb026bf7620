#include "rig/lamps/door.h"

namespace darkbox {

DoorOpen::~DoorOpen() = default;

GpioDoor::GpioDoor(const DoorDescription& door, const RequestInput& request)
    : line_(request(door.chip, {door.line, door.active_low})) {}

void require_closed(Door& door) {
    if (door.is_open()) throw DoorOpen("the door of the box is open", "close it, then resume the session");
}

}  // namespace darkbox
