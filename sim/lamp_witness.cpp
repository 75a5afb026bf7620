#include "sim/lamp_witness.h"

#include <algorithm>
#include <map>

namespace darkbox::sim {

std::vector<LampShare> burning_during(const std::vector<LampSwitch>& history, const Interval& interval) {
    std::map<LampId, double> seconds;
    for (std::size_t i = 0; i < history.size(); ++i) {
        const TimePoint end = i + 1 < history.size() ? history[i + 1].when : interval.end;
        const Nanoseconds overlap = std::min(end, interval.end) - std::max(history[i].when, interval.begin);
        if (overlap <= Nanoseconds(0)) continue;
        for (const LampShare& b : history[i].burning) seconds[b.lamp] += b.share * to_seconds(overlap);
    }
    std::vector<LampShare> shares;
    const double whole = to_seconds(interval.end - interval.begin);
    for (const auto& [lamp, lit] : seconds) shares.push_back({lamp, lit / whole});
    return shares;
}

}  // namespace darkbox::sim
