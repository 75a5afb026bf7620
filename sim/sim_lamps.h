#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "rig/lamps/lamp_array.h"
#include "rig/lamps/strobed_lamps.h"
#include "sim/faults.h"
#include "sim/lamp_witness.h"
#include "sim/sim_clock.h"

namespace darkbox::sim {

<<<<<<< HEAD
/// A lamp and how much light it gave: 1 = full level during a whole exposure.
struct LampShare {
    LampId lamp;
    double share = 0.0;
};

/// Lamps that switch at once and remember when, by command or by the simulated camera's strobe. Refers to the clock.
/// Thread-compatible.
class SimLamps final : public LampArray, public StrobedLamps {
=======
/// Lamps that switch at once and remember when. Refers to the clock. Thread-compatible.
class SimLamps final : public LampArray, public LampWitness {
>>>>>>> firmware
public:
    SimLamps(std::size_t count, const SimClock& clock, FaultPlan faults = {});
    ~SimLamps() override;

    std::size_t size() const override { return count_; }
    void light(LampId lamp, double level) override;
    void dark() override;
    LampHealth health() override { return {}; }
    StrobedLamps* strobed() override { return this; }
    void arm(const std::vector<StrobeStep>& program) override;
    std::vector<StrobeEvent> take_events() override;

    /// The strobe line fell. Moments come in the order of time, and none after now.
    void strobe(TimePoint moment);
    /// Called before every command, to bring strobes up to date that fell before it.
    void set_strobe_source(std::function<void()> catch_up) { catch_up_ = std::move(catch_up); }

    std::vector<LampShare> burning_during(const Interval& interval) const override;
    /// How often light() and dark() were called.
    std::uint64_t switches() const { return history_.size() - 1; }
    /// Whether nothing was commanded to burn last, and nothing is stuck.
    bool all_dark() const { return history_.back().burning.empty(); }

private:
<<<<<<< HEAD
    struct Switch {
        TimePoint when;
        std::vector<LampShare> burning;
    };

    void check(LampId lamp, double level) const;
    void catch_up() const;
    void command(TimePoint when, std::vector<LampShare> commanded);
=======
    void command(std::vector<LampShare> commanded);
>>>>>>> firmware
    std::vector<LampShare> really_burning(std::vector<LampShare> commanded, std::uint64_t call) const;

    std::size_t count_;
    const SimClock& clock_;
    FaultPlan faults_;
<<<<<<< HEAD
    std::vector<Switch> history_;
    std::function<void()> catch_up_;
    std::vector<StrobeStep> program_;
    std::size_t next_step_ = 0;  ///< of the program; its size: none is left
    std::vector<StrobeEvent> events_;
=======
    std::vector<LampSwitch> history_;
>>>>>>> firmware
};

}  // namespace darkbox::sim
