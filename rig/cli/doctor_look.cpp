#include <fcntl.h>
#include <grp.h>
#include <linux/gpio.h>
#include <pwd.h>
#include <sys/ioctl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>

#include "acquisition/device/unique_fd.h"
#include "rig/cli/doctor.h"

namespace darkbox {
namespace {

namespace fs = std::filesystem;

Access access_to(const fs::path& path) {
    if (::access(path.c_str(), R_OK | W_OK) == 0) return Access::open;
    return errno == EACCES || errno == EPERM ? Access::denied : Access::absent;
}

std::vector<std::string> group_names() {
    std::array<gid_t, 256> ids{};
    const int count = ::getgroups(static_cast<int>(ids.size()), ids.data());
    std::vector<std::string> names;
    for (int i = 0; i < count; ++i)
        if (const group* entry = ::getgrgid(ids.at(static_cast<std::size_t>(i)))) names.emplace_back(entry->gr_name);
    return names;
}

std::string user_name() {
    const passwd* entry = ::getpwuid(::geteuid());
    return entry != nullptr ? entry->pw_name : std::to_string(::geteuid());
}

template <std::size_t size>
std::string text_of(const char (&field)[size]) {
    return {field, ::strnlen(field, size)};
}

/// Asks the kernel; nothing is requested, so nothing changes.
GpioChipSeen look_at_chip(const fs::path& device) {
    GpioChipSeen chip{.device = device, .access = access_to(device)};
    const UniqueFd fd(::open(device.c_str(), O_RDWR | O_CLOEXEC));
    gpiochip_info info{};
    if (!fd || ::ioctl(fd.get(), GPIO_GET_CHIPINFO_IOCTL, &info) != 0) return chip;
    chip.label = text_of(info.label);
    for (unsigned offset = 0; offset < info.lines; ++offset) {
        gpio_v2_line_info line{};
        line.offset = offset;
        if (::ioctl(fd.get(), GPIO_V2_GET_LINEINFO_IOCTL, &line) != 0) continue;
        std::string holder = text_of(line.consumer);
        const bool used = (line.flags & GPIO_V2_LINE_FLAG_USED) != 0;
        if (used && holder.empty()) holder = "the kernel";
        chip.lines.push_back({.name = text_of(line.name), .holder = used ? holder : ""});
    }
    return chip;
}

std::vector<fs::path> entries(const fs::path& folder, const std::string& prefix) {
    std::vector<fs::path> found;
    std::error_code none;
    for (const auto& entry : fs::directory_iterator(folder, none))
        if (entry.path().filename().string().starts_with(prefix)) found.push_back(entry.path());
    std::ranges::sort(found);
    return found;
}

std::string group_of(const fs::path& path) {
    struct stat status{};
    if (::stat(path.c_str(), &status) != 0) return "video";
    const group* entry = ::getgrgid(status.st_gid);
    return entry != nullptr ? entry->gr_name : std::to_string(status.st_gid);
}

}  // namespace

MachineSeen look_at_machine(const RigDescription& rig) {
    MachineSeen machine;
    machine.user = user_name();
    machine.groups = group_names();
    for (const fs::path& device : entries("/dev", "gpiochip")) machine.chips.push_back(look_at_chip(device));
    machine.cameras = entries("/dev/v4l/by-id", "");
    if (machine.cameras.empty()) machine.cameras = entries("/dev", "video");
    const fs::path by_id = fs::path("/dev/v4l/by-id") / rig.camera.device;
    const fs::path camera = rig.camera.device.starts_with('/') ? fs::path(rig.camera.device) : by_id;
    machine.camera = access_to(camera);
    machine.camera_group = group_of(camera);
    for (const char* folder : {"/lib/udev/rules.d", "/etc/udev/rules.d"})
        machine.udev_rules = machine.udev_rules || fs::exists(fs::path(folder) / "60-darkbox.rules");
    look_at_usb(rig, machine);
    return machine;
}

}  // namespace darkbox
