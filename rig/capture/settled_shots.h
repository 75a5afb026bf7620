#pragma once

#include <optional>
#include <utility>

#include "rig/capture/frame_source.h"
#include "rig/capture/picture_check.h"
#include "rig/capture/taken_shot.h"
#include "rig/capture/timed_lamps.h"

namespace darkbox {

/// One shot at a time: switch, wait until the light is steady, take the first frame that begins after that. The frame
/// counts when the one that the switch spoiled shows by its shares of light that the timestamps tell the truth, or else
/// when a second exposure confirms the first. Thread-compatible.
class SettledShots {
public:
    /// All references must outlive this.
    SettledShots(const RigDescription& rig, TimedLamps& lamps, FrameSource& source, PictureCheck& check, Clock& clock)
        : rig_(rig), lamps_(lamps), source_(source), check_(check), clock_(clock) {}

    /// One try. The lamps are dark when it returns. Throws DeviceError, InputError, Cancelled.
    TakenShot take(const Shot& shot);

    /// A picture contradicted its timestamps: from here on every wait after a switch is as long as the camera can hold
    /// pictures back. Anything shorter could end just where a lie is hardest to see.
    void distrust_timestamps();

    /// The longest that a frame may take to come, besides what hangs.
    Nanoseconds frame_time() const;

private:
    void switch_to(const Shot& shot);
    void wait_for_a_telling_moment(LampId lamp);
    std::string accept(const Shot& shot, const Frame& frame, TimePoint deadline);
    /// What the frame says that the switch spoiled.
    enum class Testimony { none, agrees, contradicts };
    Testimony hear(const Shot& shot, const Frame& spoiled, const Frame& frame) const;
    [[noreturn]] void throw_lies(const Frame& spoiled);
    void refuse_repeats();
    Nanoseconds held_back() const;
    Frame first_after(TimePoint earliest, const Shot& shot, TimePoint deadline);
    TimePoint deadline_of(const Shot& shot, TimePoint steady) const;
    WitnessTolerance witness_tolerance(LampId lamp) const;
    const LampDescription& lamp(const Shot& shot) const { return rig_.lamps.at(shot.lamp->value); }

    const RigDescription& rig_;
    TimedLamps& lamps_;
    FrameSource& source_;
    PictureCheck& check_;
    Clock& clock_;
    std::optional<LampId> last_lamp_;  ///< of the latest proven shot that was lit
    TimePoint on_;
    int known_repeats_ = 0;
    Nanoseconds margin_{0};  ///< waited besides the settle time, since pictures came later than their timestamps
};

}  // namespace darkbox
