#pragma once

#include <functional>
#include <vector>

#include "acquisition/frame/ids.h"
#include "acquisition/frame/units.h"

namespace darkbox::sim {

/// A lamp and how much light it gave: 1 = full level during a whole exposure.
struct LampShare {
    LampId lamp;
    double share = 0.0;
};

/// From this moment these burn.
struct LampSwitch {
    TimePoint when;
    std::vector<LampShare> burning;
};

/// Who knows which lamps really burned; what the simulated camera sees, and where its strobe line ends, which only some
/// lamps listen to. Thread-compatible.
class LampWitness {
public:
    virtual ~LampWitness() = default;
    /// The lamps that really burned during the interval, by id; those that did not are left out.
    virtual std::vector<LampShare> burning_during(const Interval& interval) const = 0;

    /// The strobe line fell. Moments come in the order of time, and none after now.
    virtual void strobe(TimePoint /*moment*/) {}
    /// From `first` on the line rises once a period and stays up for `exposed`; a period of 0 means that it stays down.
    virtual void strobe_runs(TimePoint /*first*/, Nanoseconds /*period*/, Nanoseconds /*exposed*/) {}
    /// Called before every command, to bring strobes up to date that fell before it.
    virtual void set_strobe_source(std::function<void()> /*catch_up*/) {}
};

/// The same, of a history in the order of time.
std::vector<LampShare> burning_during(const std::vector<LampSwitch>& history, const Interval& interval);

}  // namespace darkbox::sim
