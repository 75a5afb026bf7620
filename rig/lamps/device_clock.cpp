#include "rig/lamps/device_clock.h"

namespace darkbox {

void DeviceClock::exchange(TimePoint sent, TimePoint received, std::uint32_t stamp_us) {
    const Nanoseconds half = (received - sent) / 2;
    exchanges_.push_back({sent + half, half, stamp_us});
    if (exchanges_.size() > exchanges_kept) exchanges_.pop_front();
}

std::optional<DeviceClock::Mapped> DeviceClock::map(std::uint32_t stamp_us) const {
    std::optional<Mapped> best;
    for (const Exchange& e : exchanges_) {
        const auto later_us = static_cast<std::int32_t>(stamp_us - e.stamp_us);
        const Nanoseconds later = std::chrono::microseconds(later_us);
        const Nanoseconds drifted(static_cast<Nanoseconds::rep>(drift * static_cast<double>(std::abs(later.count()))));
        const Mapped mapped{e.middle + later, e.half_width + drifted};
        if (!best || mapped.uncertainty < best->uncertainty) best = mapped;
    }
    return best;
}

}  // namespace darkbox
