#pragma once

#include <stdint.h>

#include "firmware/lampctl/lamp_set.h"

namespace darkbox {
namespace lampctl {

/// What the controller moves. A board implements it; tests record it.
class Outputs {
public:
    /// Exactly these lamps, at this level of 1 to 255; an empty set is dark at any level.
    virtual void show(const LampSet& lamps, uint8_t level) = 0;
    virtual void trigger(bool active) = 0;

protected:
    ~Outputs() = default;  // never destroyed through this: the firmware has no heap
};

}  // namespace lampctl
}  // namespace darkbox
