#pragma once

#include <functional>

#include "rig/capture/frame_sink.h"

namespace darkbox {

/// Who wants to hear of a capture's frames and events as they come, on the capture's own thread; either may be empty.
/// They must be quick, and must not throw.
struct CaptureListener {
    std::function<void(const FrameRecord&)> frame = {};  ///< proven, and handed over to be written
    std::function<void(const std::string&)> event = {};  ///< what the session notes
};

/// Tells a listener of what passes by on its way to another sink. Thread-compatible.
class ToldSink final : public FrameSink {
public:
    /// Both must outlive this.
    ToldSink(FrameSink& sink, const CaptureListener& listener) : sink_(sink), listener_(listener) {}

    const std::vector<FrameRecord>& kept() const override { return sink_.kept(); }
    Frame read(const FrameRecord& record) const override { return sink_.read(record); }
    void add(Frame frame, FrameRecord record) override {
        FrameRecord told = record;
        told.sequence = frame.sequence;
        sink_.add(std::move(frame), std::move(record));
        if (listener_.frame) listener_.frame(told);
    }
    void withdraw(const std::string& file, const std::string& why) override { sink_.withdraw(file, why); }
    void note_event(const std::string& what) override {
        sink_.note_event(what);
        if (listener_.event) listener_.event(what);
    }
    bool has_room() const override { return sink_.has_room(); }

private:
    FrameSink& sink_;
    const CaptureListener& listener_;
};

}  // namespace darkbox
