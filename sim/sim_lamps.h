#pragma once

#include <cstdint>
#include <vector>

#include "rig/lamps/lamp_array.h"
#include "sim/faults.h"
#include "sim/lamp_witness.h"
#include "sim/sim_clock.h"

namespace darkbox::sim {

/// Lamps that switch at once and remember when. Refers to the clock. Thread-compatible.
class SimLamps final : public LampArray, public LampWitness {
public:
    SimLamps(std::size_t count, const SimClock& clock, FaultPlan faults = {});
    ~SimLamps() override;

    std::size_t size() const override { return count_; }
    void light(LampId lamp, double level) override;
    void dark() override;
    LampHealth health() override { return {}; }

    std::vector<LampShare> burning_during(const Interval& interval) const override;
    /// How often light() and dark() were called.
    std::uint64_t switches() const { return history_.size() - 1; }
    /// Whether nothing was commanded to burn last, and nothing is stuck.
    bool all_dark() const { return history_.back().burning.empty(); }

private:
    void command(std::vector<LampShare> commanded);
    std::vector<LampShare> really_burning(std::vector<LampShare> commanded, std::uint64_t call) const;

    std::size_t count_;
    const SimClock& clock_;
    FaultPlan faults_;
    std::vector<LampSwitch> history_;
};

}  // namespace darkbox::sim
