#include "acquisition/camera/video_stream.h"

#include <fmt/format.h>

#include <algorithm>
#include <cerrno>

namespace darkbox {
namespace {

constexpr VideoRequest request_buffers{VIDIOC_REQBUFS, "VIDIOC_REQBUFS"};
constexpr VideoRequest query_buffer{VIDIOC_QUERYBUF, "VIDIOC_QUERYBUF"};
constexpr VideoRequest queue{VIDIOC_QBUF, "VIDIOC_QBUF"};
constexpr VideoRequest dequeue{VIDIOC_DQBUF, "VIDIOC_DQBUF"};
constexpr VideoRequest stream_on{VIDIOC_STREAMON, "VIDIOC_STREAMON"};
constexpr VideoRequest stream_off{VIDIOC_STREAMOFF, "VIDIOC_STREAMOFF"};

v4l2_buffer empty_buffer() {
    v4l2_buffer buffer{};
    buffer.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
    buffer.memory = V4L2_MEMORY_MMAP;
    return buffer;
}

v4l2_requestbuffers buffers_wanted(int count) {
    v4l2_requestbuffers request{};
    request.count = static_cast<std::uint32_t>(count);
    request.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
    request.memory = V4L2_MEMORY_MMAP;
    return request;
}

}  // namespace

VideoStream::VideoStream(VideoNode& node, int buffers) : node_(node) {
    try {
        v4l2_requestbuffers request = buffers_wanted(buffers);
        node_.call(request_buffers, request);
        if (request.count < 2)
            throw DeviceError(fmt::format("{} gives {} buffers; a stream needs 2", node_.path(), request.count),
                              "use fewer pixels, or free memory");
        for (std::uint32_t index = 0; index < request.count; ++index) map_and_queue(index);
        int type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
        node_.call(stream_on, type);
    } catch (...) {
        close();
        throw;
    }
}

void VideoStream::map_and_queue(std::uint32_t index) {
    v4l2_buffer buffer = empty_buffer();
    buffer.index = index;
    node_.call(query_buffer, buffer);
    const VideoDevice::Mapping mapping = node_.device().map(buffer.length, buffer.m.offset);
    if (mapping.error != 0) node_.fail("mmap", mapping.error);
    mapped_.push_back(mapping.bytes);
    node_.call(queue, buffer);
}

/// Errors are of no interest here: the device may be gone.
void VideoStream::close() {
    int type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
    node_.ask(stream_off, type);
    for (const auto& bytes : mapped_) node_.device().unmap(bytes);
    mapped_.clear();
    v4l2_requestbuffers none = buffers_wanted(0);
    node_.ask(request_buffers, none);
}

std::optional<v4l2_buffer> VideoStream::take(Nanoseconds patience) {
    const VideoDevice::Readiness found = node_.device().poll(patience);
    if (found == VideoDevice::Readiness::timed_out) return std::nullopt;
    v4l2_buffer buffer = empty_buffer();
    const int error = node_.ask(dequeue, buffer);
    if (error == EAGAIN && found == VideoDevice::Readiness::ready) return std::nullopt;
    if (error != 0) node_.fail(error == EAGAIN ? "poll" : dequeue.name, error == EAGAIN ? EIO : error);
    if (buffer.index >= mapped_.size())
        throw DeviceError(fmt::format("{} returns buffer {} of {}", node_.path(), buffer.index, mapped_.size()),
                          "the camera's driver is at fault; update it");
    return buffer;
}

std::span<const std::byte> VideoStream::payload(const v4l2_buffer& buffer) const {
    const std::span<const std::byte> bytes = mapped_.at(buffer.index);
    return bytes.first(std::min<std::size_t>(buffer.bytesused, bytes.size()));
}

void VideoStream::give_back(v4l2_buffer buffer) { node_.call(queue, buffer); }

}  // namespace darkbox
