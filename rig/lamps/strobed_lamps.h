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

/// Lamps that step through a program by themselves, at the camera's strobe line: each end of a frame's exposure, that
/// of its last row, makes the next step. What drives them may be slow; the steps are not. Thread-compatible.
class StrobedLamps {
public:
    virtual ~StrobedLamps() = default;
    /// Takes over a program and waits, dark, for the strobe. After the last step the lamps stay as it left them, for no
    /// longer than they bear; LampArray::light() and dark() end a program. Throws DeviceError, InputError for a program
    /// that is too long or names a lamp that is not there.
    virtual void arm(const std::vector<StrobeStep>& program) = 0;
    /// The steps made since this was last asked. Throws DeviceError.
    virtual std::vector<StrobeEvent> take_events() = 0;
};

}  // namespace darkbox
