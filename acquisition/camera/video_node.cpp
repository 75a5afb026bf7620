#include "acquisition/camera/video_node.h"

#include <fmt/format.h>
#include <linux/videodev2.h>

#include <cerrno>
#include <utility>

namespace darkbox {
namespace {

bool means_gone(int error) { return error == ENODEV || error == ENXIO; }

std::string hint_for(int error) {
    switch (error) {
        case ENOSPC:
            return "its bus has too little bandwidth: use another USB controller, fewer pixels or a lower frame_rate "
                   "of "
                   "[camera]";
        case EBUSY:
            return "another program uses the camera; stop it first";
        case EIO:
            return "the camera's signal was lost; check its cable, and the kernel's log";
        case ENOMEM:
            return "there is no memory for its buffers; use fewer pixels";
        case EACCES:
        case EPERM:
            return "this user may not use the camera: add it to the group video";
        case ENOTTY:
            return "this is no camera that streams; name another device of [camera]";
        default:
            return "check the camera's cable, and the kernel's log";
    }
}

[[noreturn]] void throw_gone(const std::string& path) {
    throw CameraGone(fmt::format("the camera {} was unplugged or is not there", path),
                     "plug the camera in again: it is waited for by that name (ls /dev/v4l/by-id)");
}

}  // namespace

CameraGone::~CameraGone() = default;

VideoNode::VideoNode(VideoDevice& device, std::string path) : device_(device), path_(std::move(path)) {
    const int error = device_.open(path_);
    if (error == ENOENT || means_gone(error)) throw_gone(path_);
    if (error != 0) throw_errno("open", path_, error, hint_for(error));
}

void VideoNode::fail(const char* call, int error) {
    v4l2_capability capability{};
    if (means_gone(error) || means_gone(device_.ioctl(VIDIOC_QUERYCAP, &capability))) throw_gone(path_);
    throw_errno(call, path_, error, hint_for(error));
}

}  // namespace darkbox
