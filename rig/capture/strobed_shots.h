#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "rig/capture/frame_source.h"
#include "rig/capture/gap_budget.h"
#include "rig/capture/picture_check.h"
#include "rig/capture/taken_shot.h"
#include "rig/capture/timed_lamps.h"

namespace darkbox {

/// One frame a lamp: the lamps step at the camera's strobe by themselves, and say when they did. A frame belongs to the
/// lamp that shone in the middle of its exposure; that nothing changed during it is the strobe line's doing. The
/// pictures must differ from lamp to lamp and from darkness as ever. Thread-compatible.
class StrobedShots {
public:
    /// All references must outlive this.
    StrobedShots(const RigDescription& rig, TimedLamps& lamps, FrameSource& source, PictureCheck& check, Clock& clock)
        : rig_(rig), lamps_(lamps), source_(source), check_(check), clock_(clock) {}

    /// As PredictiveShots::take().
    Unproven take(std::span<const Shot> shots, const ShotSink& proven);

private:
    struct Stepped {
        std::vector<Frame> frames;
        std::vector<StrobeEvent> events;
        std::string doubt;  ///< why none of the frames can be believed
    };

    Stepped step_through(const std::vector<StrobeStep>& program, const GapBudget& budget);
    void take_program(std::span<const Shot> shots, const GapBudget& budget, const ShotSink& proven);
    void leave(std::span<const Shot> shots, const std::string& reason);

    const RigDescription& rig_;
    TimedLamps& lamps_;
    FrameSource& source_;
    PictureCheck& check_;
    Clock& clock_;
    Unproven unproven_;
};

}  // namespace darkbox
