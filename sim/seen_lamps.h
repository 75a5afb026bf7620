#pragma once

#include <filesystem>
#include <vector>

#include "rig/description/rig_description.h"
#include "sim/lamp_witness.h"

namespace darkbox::sim {

/// The lamps of a board outside this process, as a file tells of them that grows by a line with each switch: the moment
/// in nanoseconds of CLOCK_MONOTONIC, the channels that burn from then on as hexadecimal bits, their level of 1 to 255.
/// That board may hear the camera's strobe line from another file: each line the first rise, then period and exposure,
/// in nanoseconds, and 0 for both when the line stays down from then on.
/// Thread-compatible.
class SeenLamps final : public LampWitness {
public:
    explicit SeenLamps(const RigDescription& rig);
    /// Throws DeviceError for a file that is not there, or not in this form.
    std::vector<LampShare> burning_during(const Interval& interval) const override;
    void strobe_runs(TimePoint first, Nanoseconds period, Nanoseconds exposed) override;

private:
    void read_on() const;

    std::filesystem::path file_;
    std::filesystem::path strobe_line_;
    std::vector<int> channels_;  ///< of each lamp
    mutable std::streamoff read_ = 0;
    mutable std::vector<LampSwitch> history_;
};

}  // namespace darkbox::sim
