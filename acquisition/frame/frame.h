#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "acquisition/frame/pixel_format.h"
#include "acquisition/frame/units.h"

namespace darkbox {

/// What the sensor was set to while a frame was exposed: read back, not as asked.
struct FrameControls {
    Seconds exposure{0};
    double gain = 1.0;
};

enum class FrameStatus {
    good,
    error,      ///< the driver flagged the buffer as damaged
    truncated,  ///< fewer bytes than the format needs
};

/// One picture off the sensor and all that is known of it. Move-only: pixels are never copied by accident.
/// Thread-compatible.
struct Frame {
    Frame() = default;
    Frame(Frame&&) = default;
    Frame& operator=(Frame&&) = default;
    Frame(const Frame&) = delete;
    Frame& operator=(const Frame&) = delete;

    int width = 0;
    int height = 0;
    PixelFormat format = PixelFormat::grey16;
    int bit_depth = 16;             ///< significant bits of a sample; full scale is 2^bit_depth - 1
    double black_level = 0.0;       ///< in sample units
    std::vector<std::byte> pixels;  ///< height rows of width * channels samples, no padding
    std::vector<std::byte> jpeg;    ///< of format mjpg: what the camera gave; `pixels` were decoded from it

    std::uint64_t sequence = 0;  ///< the driver's count; a gap means lost frames
    TimePoint timestamp;         ///< as the driver gave it
    Interval exposure;           ///< first row's start to last row's end, as derived from the timestamp
    FrameControls controls;
    FrameStatus status = FrameStatus::good;
};

}  // namespace darkbox
