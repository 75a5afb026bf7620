#pragma once

#include <string>

#include "acquisition/camera/video_device.h"
#include "acquisition/device/device_error.h"

namespace darkbox {

/// The camera is no longer there: unplugged, or its driver is gone.
class CameraGone final : public DeviceError {
public:
    using DeviceError::DeviceError;
    ~CameraGone() override;
};

/// A request to the driver and the name that people find it under.
struct VideoRequest {
    unsigned long code = 0;
    const char* name = "";
};

/// An open video node: turns what the kernel answers into errors for people. Thread-compatible.
class VideoNode {
public:
    /// Opens `path`. `device` must outlive this. Throws CameraGone when there is nothing, DeviceError.
    VideoNode(VideoDevice& device, std::string path);
    VideoNode(const VideoNode&) = delete;
    VideoNode& operator=(const VideoNode&) = delete;
    ~VideoNode() { device_.close(); }

    VideoDevice& device() { return device_; }
    const std::string& path() const { return path_; }

    /// 0, or the errno, for requests that may be refused.
    template <typename Argument>
    int ask(const VideoRequest& request, Argument& argument) {
        return device_.ioctl(request.code, &argument);
    }
    template <typename Argument>
    void call(const VideoRequest& request, Argument& argument) {
        if (const int error = ask(request, argument)) fail(request.name, error);
    }

    /// Throws CameraGone when the node no longer answers, whatever `error` says; else DeviceError.
    [[noreturn]] void fail(const char* call, int error);

private:
    VideoDevice& device_;
    std::string path_;
};

}  // namespace darkbox
