#pragma once

#include "acquisition/device/clock.h"
#include "rig/capture/lamp_timeline.h"
#include "rig/description/rig_description.h"
#include "rig/lamps/lamp_array.h"
#include "rig/lamps/strobed_lamps.h"

namespace darkbox {

/// The lamps of a run, with a record of when which of them was switched. Dark when it goes. Thread-compatible.
class TimedLamps {
public:
    /// All references must outlive this.
    TimedLamps(LampArray& lamps, Clock& clock, const RigDescription& rig);

    /// Return when the call to the lamps was made; the switch happened somewhere inside.
    Interval light(LampId lamp);
    Interval dark();
    /// A step that strobed lamps made by themselves.
    void note(const StrobeEvent& event, std::optional<LampId> lamp) { timeline_.switched(event.moment, lamp); }
    LampTimeline& timeline() { return timeline_; }
    const LampTimeline& timeline() const { return timeline_; }
    LampArray& array() { return lamps_; }

private:
    LampArray& lamps_;
    Clock& clock_;
    DarkOnExit dark_on_exit_;
    LampTimeline timeline_;
};

}  // namespace darkbox
