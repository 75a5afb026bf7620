#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "acquisition/camera/camera.h"
#include "acquisition/camera/video_node.h"

namespace darkbox {

/// A camera's controls as settle_controls() left them.
struct SettledControls {
    FrameControls in_effect;
    std::optional<CameraInfo::ExposureRange> exposure_range = {};
    bool tells_exposure = true;  ///< false: it has no such control, and in_effect is not known to hold
    bool tells_gain = true;
    std::int32_t lowest_gain = 1;       ///< value of the camera's control at gain 1
    std::vector<std::string> absent;    ///< controls that it does not have, by V4L2's names
    std::vector<std::string> inactive;  ///< those it has, but says they do nothing now
};

/// Switches off every automatism, makes every "improvement" neutral, sets exposure and gain, and reads all of it back.
/// Gain 1 is the least that the camera's control can do; other gains need a control that does not begin at 0, whose
/// values are then taken as proportional to the gain. Throws DeviceError that names a control which is there and does
/// not hold; InputError for an exposure or a gain outside its range.
SettledControls settle_controls(VideoNode& node, const CameraConfig& config);

/// What is in effect now; what the camera does not tell is as it was.
FrameControls read_controls(VideoNode& node, const SettledControls& settled);

}  // namespace darkbox
