#pragma once

#include <filesystem>
#include <vector>

#include "rig/description/rig_description.h"
#include "sim/lamp_witness.h"

namespace darkbox::sim {

/// The lamps of a board outside this process, as a file tells of them that grows by a line with each switch: the moment
/// in nanoseconds of CLOCK_MONOTONIC, the channels that burn from then on as hexadecimal bits, their level of 1 to 255.
/// Thread-compatible.
class SeenLamps final : public LampWitness {
public:
    explicit SeenLamps(const RigDescription& rig);
    /// Throws DeviceError for a file that is not there, or not in this form.
    std::vector<LampShare> burning_during(const Interval& interval) const override;

private:
    void read_on() const;

    std::filesystem::path file_;
    std::vector<int> channels_;  ///< of each lamp
    mutable std::streamoff read_ = 0;
    mutable std::vector<LampSwitch> history_;
};

}  // namespace darkbox::sim
