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

/// Lamps that switch at once and remember when, by command or by the simulated camera's strobe. Refers to the clock.
/// Thread-compatible.
class SimLamps final : public LampArray, public LampWitness, public StrobedLamps {
public:
    SimLamps(std::size_t count, const SimClock& clock, FaultPlan faults = {});
    ~SimLamps() override;

    std::size_t size() const override { return count_; }
    void light(LampId lamp, double level) override;
    void dark() override;
    LampHealth health() override;
    StrobedLamps* strobed() override { return this; }
    void arm(const std::vector<StrobeStep>& program, Nanoseconds exposed) override;
    std::vector<StrobeEvent> take_events() override;

    void strobe(TimePoint moment) override;
    void set_strobe_source(std::function<void()> catch_up) override { catch_up_ = std::move(catch_up); }

    std::vector<LampShare> burning_during(const Interval& interval) const override;
    /// How often light() and dark() were called.
    std::uint64_t switches() const { return history_.size() - 1; }
    /// Whether nothing was commanded to burn last, and nothing is stuck.
    bool all_dark() const { return history_.back().burning.empty(); }

private:
    void check(LampId lamp, double level) const;
    void catch_up() const;
    void command(TimePoint when, std::vector<LampShare> commanded);
    std::vector<LampShare> really_burning(std::vector<LampShare> commanded, std::uint64_t call) const;

    std::size_t count_;
    const SimClock& clock_;
    FaultPlan faults_;
    std::vector<LampSwitch> history_;
    std::function<void()> catch_up_;
    std::vector<StrobeStep> program_;
    std::size_t next_step_ = 0;  ///< of the program; its size: none is left
    std::vector<StrobeEvent> events_;
};

}  // namespace darkbox::sim
