#pragma once

#include <optional>
#include <vector>

#include "rig/description/rig_description.h"
#include "rig/lamps/lamp_array.h"
#include "rig/lamps/lamp_controller.h"
#include "rig/lamps/strobed_lamps.h"

namespace darkbox {

/// One step of a program that the board runs by itself: this lamp alone is lit; `lead` later its exposure begins, at
/// once or with the camera's strobe; `exposure` later the next step follows.
struct LampStep {
    std::optional<LampId> lamp;  ///< none: a dark frame
    double level = 1.0;          ///< (0, 1]
    Nanoseconds lead{0};         ///< for the lamp to settle; up to 16.7 s
    Nanoseconds exposure{0};     ///< 50 us to 16.7 s
    bool trigger = false;        ///< the trigger output is active during the exposure
    bool wait_for_strobe = false;
};

/// A step that is over, in the host's time.
struct LampStepDone {
    std::size_t step = 0;
    std::uint32_t round = 0;
    std::optional<LampId> lamp;
    Interval exposure;
    Nanoseconds uncertainty{0};  ///< of the interval's place, either way
};

/// Lamps on the project's own controller. The board darkens them by itself when this process dies or hangs, when a lamp
/// reached its max_on or max_duty, and when it is unplugged; dark() waits for a board that was unplugged to come back,
/// and throws even so when that interrupted a lamp's light and nobody was told yet: the shot is to be taken again.
/// Thread-compatible; the heartbeat has a thread of its own.
class UsbLamps final : public LampArray, public StrobedLamps {
public:
    /// Opens the board that [lamps.usb] names. Throws DeviceError, and InputError where the description asks for what
    /// the board cannot do.
    explicit UsbLamps(const RigDescription& rig, LampControllerOptions options);
    explicit UsbLamps(const RigDescription& rig);
    ~UsbLamps() override;

    std::size_t size() const override { return channels_.size(); }
    void light(LampId lamp, double level) override;
    void dark() override;
    LampHealth health() override;
    StrobedLamps* strobed() override { return this; }

    /// On the board: a dark step that waits for the strobe, then the lamps, each lit for one exposure of `exposed`.
    void arm(const std::vector<StrobeStep>& program, Nanoseconds exposed) override;
    std::vector<StrobeEvent> take_events() override;

    /// Uploads the steps, at most 66, and starts them. The lamps are dark until the first begins, and after the last.
    void run_program(const std::vector<LampStep>& steps, std::uint16_t rounds = 1);
    /// Waits for the next step to be over; none when the program is. Throws DeadlineError at the deadline, DeviceError
    /// when the board gave up: the strobe stayed out, a lamp's budget was used up, it was unplugged, events were lost.
    std::optional<LampStepDone> next_step_done(TimePoint deadline);

    LampController& controller() { return controller_; }

private:
    struct Channel {
        std::uint8_t output = 0;
        lamp_protocol::LimitCommand limit{};
        std::string name;
    };

    void check(const RigDescription& rig) const;
    void set_up();
    bool darken();
    bool is_dark();
    lamp_protocol::Step step_of(const LampStep& step) const;
    std::optional<LampEvent> program_event(TimePoint deadline);
    LampStepDone step_done(const LampEvent& event) const;

    std::vector<Channel> channels_;
    LampController controller_;
    std::uint64_t events_lost_before_ = 0;
    bool lit_ = false;        ///< as far as is known here
    bool stepping_ = false;   ///< a strobed program is under way
    bool loss_told_ = false;  ///< of the board, since it was last reached
};

}  // namespace darkbox
