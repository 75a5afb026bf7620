#pragma once

#include <linux/videodev2.h>

#include <optional>
#include <span>
#include <vector>

#include "acquisition/camera/video_node.h"

namespace darkbox {

/// Memory-mapped streaming: runs from its constructor to its destructor. Thread-compatible.
class VideoStream {
public:
    /// Throws DeviceError when the driver refuses buffers or the stream, CameraGone. `node` must outlive this.
    VideoStream(VideoNode& node, int buffers);
    VideoStream(const VideoStream&) = delete;
    VideoStream& operator=(const VideoStream&) = delete;
    ~VideoStream() { close(); }

    /// How many the driver gave.
    int buffers() const { return static_cast<int>(mapped_.size()); }

    /// A finished buffer; no value when none is finished within `patience`. It is the caller's until give_back().
    std::optional<v4l2_buffer> take(Nanoseconds patience);
    /// What the driver says it filled; never beyond the buffer.
    std::span<const std::byte> payload(const v4l2_buffer& buffer) const;
    void give_back(v4l2_buffer buffer);

private:
    void close();
    void map_and_queue(std::uint32_t index);

    VideoNode& node_;
    std::vector<std::span<std::byte>> mapped_;
};

}  // namespace darkbox
