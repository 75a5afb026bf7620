#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "acquisition/camera/camera.h"
#include "acquisition/camera/frame_timing.h"
#include "acquisition/camera/video_controls.h"
#include "acquisition/camera/video_mode.h"
#include "acquisition/camera/video_stream.h"
#include "acquisition/device/clock.h"

namespace darkbox {

/// The names under which udev keeps cameras in spite of replugging, sorted: those of /dev/v4l/by-id.
std::vector<std::string> camera_ids(const std::filesystem::path& folder = "/dev/v4l/by-id");

/// A camera behind Linux' V4L2: single-planar, memory-mapped streaming. Samples are kept as the sensor gave them.
///
/// A frame's exposure is derived from its timestamp by the driver's flags and never too short: the readout, which V4L2
/// does not tell, is taken as long as a frame's period. uvcvideo claims the start of exposure and stamps the start of
/// reception; it is taken at what it does. Timestamps of another clock than CLOCK_MONOTONIC are a DeviceError.
///
/// A camera that is unplugged while it streams is a DeviceError that says so. After stop() and start(), next_frame()
/// waits, up to its deadline, for the same name to come back, and sets the camera up as it was; one that then delivers
/// another picture is a DeviceError.
class V4l2Camera final : public Camera {
public:
    /// `device` and `clock` must outlive this. Touches nothing yet. Throws InputError for options out of range.
    V4l2Camera(VideoDevice& device, Clock& clock, V4l2Options options);
    ~V4l2Camera() override;

    /// Opens the camera anew, settles its controls and its picture.
    CameraInfo configure(const CameraConfig& config) override;
    void start() override;
    Frame next_frame(TimePoint deadline) override;
    void stop() override;

private:
    enum class State { closed, ready, streaming };
    /// All that one opening of the camera came to.
    struct Setup {
        CameraInfo info;
        VideoMode mode;
        SettledControls controls;
    };

    Setup set_up();
    CameraInfo describe(const v4l2_capability& capability, const Setup& setup) const;
    void release();
    void open_stream();
    void await_return(TimePoint deadline);
    void require_same(const Setup& returned) const;
    Frame frame_of(const v4l2_buffer& buffer);
    StampedMoment stamped_moment(const v4l2_buffer& buffer) const;
    std::uint64_t extend(std::uint32_t sequence);

    VideoDevice& device_;
    Clock& clock_;
    V4l2Options options_;
    CameraConfig config_;
    State state_ = State::closed;
    bool is_uvc_ = false;
    std::unique_ptr<VideoNode> node_;
    std::unique_ptr<VideoStream> stream_;  ///< none while streaming: the camera is gone and waited for
    std::optional<Setup> setup_;
    std::optional<std::uint64_t> last_sequence_;  ///< of this stream
};

}  // namespace darkbox
