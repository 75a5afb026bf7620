#pragma once

#include <deque>
#include <optional>
#include <vector>

#include "acquisition/frame/ids.h"
#include "acquisition/frame/units.h"

namespace darkbox {

/// Which lamp lit a frame: the switches of the lamps on the capture's clock, and what a frame's exposure says beside
/// them. A switch is known as the interval of the call that made it: the change happened somewhere inside.
/// Dark from the beginning of time. Thread-compatible.
class LampTimeline {
public:
    /// The one thing that shone: a lamp, or none.
    struct Light {
        std::optional<LampId> lamp;
        TimePoint on;  ///< the call that lit it (or darkened all) had returned
    };

    /// `settle`: of every lamp by its id, from the call's return to steady light, and from darkening to darkness.
    explicit LampTimeline(std::vector<Nanoseconds> settle) : settle_(std::move(settle)) {}

    /// This lamp alone, or none, shines after `call`. Calls come in the order of time. Darkening what is dark is no
    /// switch.
    void switched(const Interval& call, std::optional<LampId> lamp);

    /// What alone and steadily lit all of the exposure, `margin` before and behind it included; none where a switch, a
    /// lamp that comes up, or one that fades reaches into it.
    std::optional<Light> sole_light(const Interval& exposure, Nanoseconds margin) const;

    /// The share of the interval during which the lamp shone, each switch taken at its call's middle and as sudden.
    double share(LampId lamp, const Interval& interval) const;

    /// From when on the present state is steady and alone.
    TimePoint steady_from() const;

private:
    struct State {
        Interval call;
        std::optional<LampId> lamp;
        TimePoint steady;  ///< it has come up, and every earlier lamp has faded
    };
    Nanoseconds settle_of(std::optional<LampId> lamp) const;

    std::vector<Nanoseconds> settle_;
    std::deque<State> states_;  ///< the latest, oldest first
};

}  // namespace darkbox
