#pragma once

#include <optional>
#include <string>
#include <vector>

#include "acquisition/frame/frame.h"

namespace darkbox {

/// What is asked of a camera before a capture.
struct CameraConfig {
    Seconds exposure{0.02};
    double gain = 1.0;
};

/// What is really in effect after configure().
struct CameraInfo {
    std::string model;
    std::string id;      ///< stable over replugging
    std::string driver;  ///< of the kernel; "sim"
    int width = 0;       ///< pixels
    int height = 0;
    PixelFormat format = PixelFormat::grey16;
    int bit_depth = 16;
    double black_level = 0.0;  ///< sample units
    Seconds frame_period{1.0 / 30};
    int queue_depth = 1;     ///< buffers that may hold stale frames
    int latency_frames = 0;  ///< exposures that pass before new controls take effect
    /// Rolling shutter: from the first row's end of exposure to the last row's; 0: all rows at once; none: not known,
    /// and frames' exposures are taken as long as they may be.
    std::optional<Seconds> readout;
    FrameControls controls;
    /// The exposures that it can be set to; none: not known.
    struct ExposureRange {
        Seconds shortest{0};
        Seconds longest{0};
    };
    std::optional<ExposureRange> exposure_range = {};
    std::vector<std::string> notes;  ///< what a session should keep of it besides, in words
};

/// A source of frames. States: closed -configure-> ready -start-> streaming -stop-> ready; configure() is also good in
/// ready, so that a second capture or another exposure needs no new camera. Any other call is a std::logic_error.
/// Thread-compatible: one thread drives it.
class Camera {
public:
    virtual ~Camera() = default;
    virtual CameraInfo configure(const CameraConfig& config) = 0;
    virtual void start() = 0;
    /// The oldest finished frame; waits for one. Throws DeadlineError at `deadline`, DeviceError when the camera fails.
    virtual Frame next_frame(TimePoint deadline) = 0;
    /// Safe in any state.
    virtual void stop() = 0;
};

}  // namespace darkbox
