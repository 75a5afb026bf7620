#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <optional>
#include <utility>

#include "acquisition/camera/camera.h"
#include "acquisition/device/clock.h"
#include "acquisition/device/device_error.h"
#include "acquisition/frame/progress.h"
#include "rig/capture/exposure_clock.h"

namespace darkbox {

/// A frame that did not arrive whole, or not in its place; the next may be good.
class DamagedFrame : public DeviceError {
public:
    using DeviceError::DeviceError;
};

/// What was measured of a camera as it is set up; none where nothing was. May be empty.
using TimingLookup = std::function<std::optional<MeasuredTiming>(const CameraInfo&)>;

/// Frames of one run, in order and undamaged, with a way out while a camera hangs. Stops the camera when it goes.
/// Thread-compatible.
class FrameSource {
public:
    /// Configures and starts the camera. All references must outlive this. Throws DeviceError.
    FrameSource(Camera& camera, Clock& clock, const CameraConfig& config, const WorkContext& work,
                const TimingLookup& timings = {});
    FrameSource(const FrameSource&) = delete;
    FrameSource& operator=(const FrameSource&) = delete;
    ~FrameSource();

    const CameraInfo& info() const { return info_; }

    /// Brings a camera that failed back to streaming: it is stopped and started once, and its first frame is awaited,
    /// so that one that was unplugged is waited for here, while the lamps are dark.
    void recover(Nanoseconds patience);

    /// The first frame whose exposure begins at `earliest` or later, and whose stamp keeps the camera's rhythm; others,
    /// which a queue held back, are passed over. Once the rhythm is known it tells a frame's exposure. Throws
    /// DeviceError for a damaged, misfitting or repeated frame, DeadlineError, Cancelled.
    Frame first_after(TimePoint earliest, TimePoint deadline);

    /// The frame right before the one that first_after() gave, if that passed it over and it is undamaged.
    std::optional<Frame> take_passed_over();

    /// The next frame; none when no frame is finished until `moment`. Throws as first_after().
    std::optional<Frame> next_until(TimePoint moment);

    /// Looks at frames until the camera's rhythm is known; false when it is not by `deadline`.
    bool find_rhythm(TimePoint deadline);

    /// The camera's rhythm so far.
    const ExposureClock& rhythm() const { return rhythm_; }
    /// Whether the latest frame's timestamp keeps it.
    bool in_rhythm() const { return in_rhythm_; }
    /// The frame whose bits the latest frame repeats, if there is one: one picture under two numbers. Dark frames are
    /// not looked at.
    std::optional<std::uint64_t> repeated() const { return repeated_; }
    /// How many did so far, passed-over ones included.
    int repeats() const { return repeats_; }

    /// Frames that were lost while first_after() waited, since this was last asked.
    std::uint64_t take_lost() { return std::exchange(lost_, 0); }

private:
    /// Where a frame stands in the camera's stream.
    struct Place {
        std::optional<std::uint64_t> sequence;
        std::optional<TimePoint> timestamp;
    };

    Frame next(TimePoint deadline);
    Frame next_of_several(TimePoint deadline, int passed_over);
    /// Its place in the stream is noted, its exposure is the one measured.
    Place take_in(Frame& frame);
    /// New controls take some exposures to come into effect: a frame of before, which is no fault.
    bool has_old_controls(const Frame& frame) const;
    bool is_dark(const Frame& frame) const;
    void note_picture(const Frame& frame);
    /// A queue that was full when the wait began lost frames of before, which is no fault: they are not counted.
    std::uint64_t lost_while_waiting(const Frame& frame, const Place& before, TimePoint begin) const;
    void check_order(const Frame& frame, const Place& before) const;
    void check_present(const Frame& frame) const;

    Camera& camera_;
    Clock& clock_;
    const WorkContext& work_;
    CameraInfo info_;
    std::optional<MeasuredTiming> measured_;
    ExposureClock rhythm_;
    TimePoint told_end_;  ///< of the exposure of the frame taken in last
    bool in_rhythm_ = true;
    std::deque<std::pair<std::uint64_t, std::uint64_t>> pictures_;  ///< sequence and hash of the latest
    std::optional<std::uint64_t> repeated_;
    int repeats_ = 0;
    std::optional<Frame> passed_over_;
    bool failed_ = false;
    int since_start_ = 0;  ///< frames taken in since the camera was started
    Place last_;           ///< of the last frame since the camera was started
    std::uint64_t lost_ = 0;
};

/// Throws Cancelled when the work was asked to stop.
void stop_when_asked(const WorkContext& work);

/// Throws DamagedFrame when the frame is not what the camera said it delivers: damaged, truncated, of another size or
/// format, or exposed with other controls.
void check_frame(const Frame& frame, const CameraInfo& camera);

}  // namespace darkbox
