#pragma once

#include <string>
#include <vector>

#include "acquisition/frame/frame.h"
#include "acquisition/session/session.h"

namespace darkbox {

/// Where a capture's proven frames go. Thread-compatible.
class FrameSink {
public:
    virtual ~FrameSink() = default;
    /// What an earlier run of the same session left here; does not change while this one lasts.
    virtual const std::vector<FrameRecord>& kept() const = 0;
    /// The pixels of one of those.
    virtual Frame read(const FrameRecord& record) const = 0;
    /// Takes a frame, later or at once, or throws: never drops it. Throws DeviceError when one cannot be kept, be it
    /// this one or one before.
    virtual void add(Frame frame, FrameRecord record) = 0;
    /// Gives a frame up that was added, or kept by an earlier run: it is to be taken again, under the same name.
    virtual void withdraw(const std::string& file, const std::string& why) = 0;
    virtual void note_event(const std::string& what) = 0;
    /// Whether add() would return at once. The lamps are darkened before a wait.
    virtual bool has_room() const = 0;
};

}  // namespace darkbox
