#pragma once

#include <span>
#include <string>

#include "rig/capture/exposure_clock.h"
#include "rig/capture/taken_shot.h"
#include "rig/description/rig_description.h"

namespace darkbox {

/// What must fit between two exposures for the lamps to be switched there.
struct GapBudget {
    Nanoseconds period{0};
    Nanoseconds exposed{0};    ///< first row's begin to last row's end: exposure and read-out
    Nanoseconds settle{0};     ///< of the slowest lamp
    Nanoseconds switching{0};  ///< a call to the lamps
    Nanoseconds margin{0};     ///< on either side: jitter, and what a witness cannot see

    bool fits() const { return exposed + settle + switching + 2 * margin <= period; }
    /// "16.7 ms between frames, of which exposure and read-out take 14.0, ..."
    std::string words() const;
};

/// For a camera in its rhythm, which must be locked, and the lamps of these shots.
GapBudget gap_budget(const ExposureClock& rhythm, const RigDescription& rig, std::span<const Shot> shots);

}  // namespace darkbox
