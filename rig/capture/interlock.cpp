#include "rig/capture/interlock.h"

#include "acquisition/device/device_error.h"

namespace darkbox {

void InterlockedLamps::watch() {
    try {
        require_closed(door_);
    } catch (...) {  // a door that cannot be told counts as open
        lamps_.dark();
        throw;
    }
}

void InterlockedLamps::light(LampId lamp, double level) {
    watch();
    lamps_.light(lamp, level);
}

void InterlockedLamps::arm(const std::vector<StrobeStep>& program, Nanoseconds exposed) {
    watch();
    lamps_.strobed()->arm(program, exposed);
}

Frame InterlockedCamera::next_frame(TimePoint deadline) {
    lamps_.watch();
    try {
        Frame frame = camera_.next_frame(deadline);
        lamps_.watch();
        return frame;
    } catch (const DeadlineError&) {
        lamps_.watch();
        throw;
    }
}

}  // namespace darkbox
