#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "acquisition/frame/ids.h"
#include "acquisition/frame/units.h"

namespace darkbox {

/// One step of a program: this lamp alone, or none.
struct StrobeStep {
    std::optional<LampId> lamp;
    double level = 1.0;  ///< in (0, 1]
};

/// A step that was made.
struct StrobeEvent {
    std::size_t step = 0;  ///< of the program
    Interval moment;       ///< on the capture's clock: the lamps changed somewhere inside
};

/// Lamps that step through a program by themselves, at the camera's strobe line, which is up while a frame is exposed,
/// first row to last: each end of an exposure makes the next step. What drives them may be slow; the steps are not.
/// Thread-compatible.
class StrobedLamps {
public:
    static constexpr std::size_t longest_program = 66;  ///< steps

    virtual ~StrobedLamps() = default;
    /// Takes over a program, whose last step is dark, and waits, dark, for the strobe. `exposed` is how long after its
    /// rise every row is exposed, for lamps that look at the rise alone. LampArray::light() and dark() end a program.
    /// Throws DeviceError, and std::invalid_argument for a program that is too long, does not end dark, or names a lamp
    /// that is not there.
    virtual void arm(const std::vector<StrobeStep>& program, Nanoseconds exposed) = 0;
    /// The steps made since this was last asked. Throws DeviceError.
    virtual std::vector<StrobeEvent> take_events() = 0;
};

}  // namespace darkbox
