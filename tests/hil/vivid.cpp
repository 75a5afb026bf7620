#include "tests/hil/vivid.h"

#include <fmt/format.h>
#include <linux/videodev2.h>

#include <filesystem>
#include <stdexcept>

#include "acquisition/camera/video_device.h"
#include "tests/hil/machine.h"

namespace darkbox::test {
namespace {

v4l2_control control(const std::string& node, unsigned long request, std::uint32_t id, int value) {
    KernelVideoDevice device;
    v4l2_control control{id, value};
    int error = device.open(node);
    if (error == 0) error = device.ioctl(request, &control);
    if (error != 0) throw std::runtime_error(fmt::format("vivid's control {:#x}: error {}", id, error));
    return control;
}

/// Empty while there is none.
std::string node_named(const std::string& name) {
    for (const auto& entry : std::filesystem::directory_iterator("/sys/class/video4linux"))
        if (text_of(entry.path() / "name") == name + "\n") return "/dev/" + entry.path().filename().string();
    return {};
}

}  // namespace

Vivid::Vivid() {
    must("modprobe vivid n_devs=2 node_types=0x1,0x1 multiplanar=1,1 num_inputs=1,1 input_types=0x0,0x3");
    webcam_ = node_named("vivid-000-vid-cap");
    hdmi_ = node_named("vivid-001-vid-cap");
    if (webcam_.empty() || hdmi_.empty()) throw std::runtime_error("vivid made no nodes");
    set(osd_text_mode, no_text);
    set(timestamp_source, start_of_exposure);
}

Vivid::~Vivid() {
    // udev may still look at its nodes.
    comes_true([] { return shell("rmmod vivid").status == 0; });
}

void Vivid::set(std::uint32_t id, int value) const { control(webcam(), VIDIOC_S_CTRL, id, value); }
int Vivid::get(std::uint32_t id) const { return control(webcam(), VIDIOC_G_CTRL, id, 0).value; }

}  // namespace darkbox::test
