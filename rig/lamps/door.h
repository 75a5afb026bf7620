#pragma once

#include <memory>

#include "acquisition/frame/error.h"
#include "rig/description/rig_description.h"
#include "rig/lamps/gpio_lines.h"

namespace darkbox {

/// The box was opened: nothing is tried again, the session stays as it is and can be resumed.
class DoorOpen : public Error {
public:
    using Error::Error;
    ~DoorOpen() override;
};

/// The switch at the dark box's door. Thread-compatible.
class Door {
public:
    virtual ~Door() = default;
    /// Throws DeviceError when it cannot be told.
    virtual bool is_open() = 0;
};

/// On a GPIO line that is active while the door is open: wired so that a cut cable reads as open.
class GpioDoor final : public Door {
public:
    GpioDoor(const DoorDescription& door, const RequestInput& request);
    bool is_open() override { return line_->active(); }

private:
    std::unique_ptr<InputLine> line_;
};

/// Throws DoorOpen while the door is open.
void require_closed(Door& door);

}  // namespace darkbox
