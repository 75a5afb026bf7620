#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "acquisition/camera/sensor_layout.h"
#include "acquisition/camera/video_node.h"
#include "acquisition/frame/units.h"

namespace darkbox {

/// What is asked of a V4L2 camera for as long as it is used.
struct V4l2Options {
    std::string device;                      ///< a path, best below /dev/v4l/by-id, or a name in there
    std::string format;                      ///< four characters, "Y16"; empty: the best that the camera has
    int width = 0;                           ///< pixels; 0 with height: the largest picture
    int height = 0;                          ///< pixels
    std::optional<double> frame_rate;        ///< per second; none: the fastest whose period holds the exposure
    std::optional<std::array<int, 4>> crop;  ///< left, top, width, height on the sensor; none: its default
    int buffers = 4;                         ///< 2 to 32: frames that may wait

    /// Throws InputError that names the field, the value and what is allowed.
    void validate() const;
};

/// What the driver agreed to.
struct VideoMode {
    SensorLayout layout;
    Seconds frame_period{0};

    friend bool operator==(const VideoMode& a, const VideoMode& b) {
        return a.layout.format.fourcc == b.layout.format.fourcc && a.layout.width == b.layout.width &&
               a.layout.height == b.layout.height && a.layout.bytes_per_line == b.layout.bytes_per_line &&
               a.frame_period == b.frame_period;
    }
};

/// Crop, format, size and frame interval, in this order, each read back. Throws InputError for what the camera does not
/// have, telling what it has; DeviceError for a driver that accepts one thing and does another.
VideoMode negotiate(VideoNode& node, const V4l2Options& options, Seconds exposure);

}  // namespace darkbox
