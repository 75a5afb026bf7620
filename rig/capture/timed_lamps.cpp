#include "rig/capture/timed_lamps.h"

namespace darkbox {
namespace {

std::vector<Nanoseconds> settle_times(const RigDescription& rig) {
    std::vector<Nanoseconds> times;
    for (const LampDescription& lamp : rig.lamps) times.push_back(to_nanoseconds(lamp.settle));
    return times;
}

}  // namespace

TimedLamps::TimedLamps(LampArray& lamps, Clock& clock, const RigDescription& rig)
    : lamps_(lamps), clock_(clock), dark_on_exit_(lamps), timeline_(settle_times(rig)) {}

Interval TimedLamps::light(LampId lamp) {
    const TimePoint begin = clock_.now();
    lamps_.light(lamp, 1.0);
    const Interval call{begin, clock_.now()};
    timeline_.switched(call, lamp);
    return call;
}

Interval TimedLamps::dark() {
    const TimePoint begin = clock_.now();
    lamps_.dark();
    const Interval call{begin, clock_.now()};
    timeline_.switched(call, std::nullopt);
    return call;
}

}  // namespace darkbox
