#pragma once

#include <functional>
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

/// One frame a lamp: the lamps are switched in the gaps between exposures, which the camera's rhythm predicts. Frames
/// are told apart by the switches as they really were, so a switch that comes late costs a frame and never a wrong one.
/// The first switch, the last, and one in every block fall into the middle of an exposure: that frame is spoiled and
/// witnesses that the timestamps tell the truth (switch_witness.h). A block's frames count when both witnesses at its
/// ends, and every picture in it, agree. Pictures are looked at while the next is exposed, so that no more than the
/// witnesses is left to do at a block's end. Thread-compatible.
class PredictiveShots {
public:
    /// All references must outlive this.
    PredictiveShots(const RigDescription& rig, TimedLamps& lamps, FrameSource& source, PictureCheck& check,
                    Clock& clock)
        : rig_(rig), lamps_(lamps), source_(source), check_(check), clock_(clock) {}

    /// Lit shots in their order; `proven` is called for each that is proven, in order within a block. Lamps are dark
    /// before it and after. Throws Cancelled, and DeviceError when the camera fails.
    Unproven take(std::span<const Shot> shots, const ShotSink& proven);

private:
    /// A frame that a switch in mid-exposure spoils.
    struct Witness {
        std::uint64_t sequence = 0;
        std::optional<std::size_t> before;  ///< shot; none: darkness
        std::optional<std::size_t> after;
        std::optional<Frame> frame;
        std::optional<std::string> doubt;  ///< once it was heard: why not to believe it; empty when it agrees
    };
    struct Pending {
        std::uint64_t first = 0;  ///< frames from here on may be this shot's
        std::optional<Frame> frame;
        std::optional<Frame> confirming;  ///< of the very first, whose noise is not known yet
        std::string found;                ///< of its picture, once that was looked at
        TimePoint on;
        TimePoint off;
    };

    GapBudget budget() const;
    void run();
    Interval light(std::size_t shot, TimePoint moment);
    void probe(std::optional<std::size_t> before, std::optional<std::size_t> after);
    bool switch_within(const Witness& witness);
    void take_back(std::optional<std::size_t> before, std::optional<std::size_t> after);
    TimePoint gap_after(std::uint64_t sequence) const;
    void pump_until(TimePoint moment);
    void file(Frame frame);
    void await(std::uint64_t sequence);
    std::size_t shots_in_a_block() const;
    void settle_blocks(bool all);
    void begin_block();
    void look_at_pictures(std::size_t last, bool all);
    std::string verify(std::size_t first, std::size_t last, Witness& opening, Witness& closing);
    void hand_on(std::size_t shot);
    ExpectedShares expected_in(const Witness& witness) const;
    std::string heard(const Witness& witness) const;
    struct Repeat {
        std::uint64_t sequence = 0;
        std::string words;
    };
    WitnessTolerance tolerance() const;
    std::optional<double> probe_share() const;
    bool lamps_bear(int periods) const;
    void expect_frames() const;
    std::string name_of(std::size_t shot) const { return rig_.lamps.at(shots_[shot].lamp->value).name; }
    void leave(std::size_t first, std::size_t last, const std::string& reason);

    const RigDescription& rig_;
    TimedLamps& lamps_;
    FrameSource& source_;
    PictureCheck& check_;
    Clock& clock_;
    std::span<const Shot> shots_;
    const ShotSink* proven_ = nullptr;
    std::vector<Pending> pending_;              ///< for each shot that was lit
    std::vector<Witness> witnesses_;            ///< oldest first; block k lies between witnesses k and k + 1
    std::vector<Repeat> repeats_;               ///< frames that carried a picture of before
    std::size_t block_ = 0;                     ///< the oldest that is not settled
    std::size_t next_look_ = 0;                 ///< the first of its shots whose picture was not looked at
    std::string block_doubt_;                   ///< what one of its pictures showed that should not be there
    std::optional<PictureCheck> check_before_;  ///< the block
    std::uint64_t last_frame_ = 0;              ///< that the latest lit shot needs
    std::uint64_t seen_ = 0;                    ///< the latest frame's number
    Unproven unproven_;
};

}  // namespace darkbox
