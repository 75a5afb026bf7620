#pragma once

#include <cstdint>
#include <optional>
#include <utility>

#include "acquisition/camera/camera.h"
#include "acquisition/device/clock.h"
#include "acquisition/frame/progress.h"

namespace darkbox {

/// Frames of one run, in order and undamaged, with a way out while a camera hangs. Stops the camera when it goes.
/// Thread-compatible.
class FrameSource {
public:
    /// Configures and starts the camera. All references must outlive this. Throws DeviceError.
    FrameSource(Camera& camera, Clock& clock, const CameraConfig& config, const WorkContext& work);
    FrameSource(const FrameSource&) = delete;
    FrameSource& operator=(const FrameSource&) = delete;
    ~FrameSource();

    const CameraInfo& info() const { return info_; }

    /// Brings a camera that failed back to streaming: it is stopped and started once, and its first frame is awaited,
    /// so that one that was unplugged is waited for here, while the lamps are dark.
    void recover(Nanoseconds patience);

    /// The first frame whose exposure begins at `earliest` or later; older ones, which a queue held back, are passed
    /// over. Throws DeviceError for a damaged, misfitting or repeated frame, DeadlineError, Cancelled.
    Frame first_after(TimePoint earliest, TimePoint deadline);

    /// Frames that were lost while first_after() waited, since this was last asked.
    std::uint64_t take_lost() { return std::exchange(lost_, 0); }

private:
    /// Where a frame stands in the camera's stream.
    struct Place {
        std::optional<std::uint64_t> sequence;
        std::optional<TimePoint> timestamp;
    };

    Frame next(TimePoint deadline);
    /// A queue that was full when the wait began lost frames of before, which is no fault: they are not counted.
    std::uint64_t lost_while_waiting(const Frame& frame, const Place& before, TimePoint begin) const;
    void check_order(const Frame& frame, const Place& before) const;

    Camera& camera_;
    Clock& clock_;
    const WorkContext& work_;
    CameraInfo info_;
    bool failed_ = false;
    Place last_;  ///< of the last frame since the camera was started
    std::uint64_t lost_ = 0;
};

/// Throws Cancelled when the work was asked to stop.
void stop_when_asked(const WorkContext& work);

/// Throws DeviceError when the frame is not what the camera said it delivers: damaged, truncated, of another size or
/// format, or exposed with other controls.
void check_frame(const Frame& frame, const CameraInfo& camera);

}  // namespace darkbox
