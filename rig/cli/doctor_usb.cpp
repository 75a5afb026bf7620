#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <fstream>

#include "firmware/protocol/lamp_protocol.h"
#include "rig/cli/doctor.h"

namespace darkbox {
namespace {

namespace fs = std::filesystem;

/// Of a bus' bits a second, what pictures get: the rest is framing and gaps. 480 Mbit/s carry some 39 MB/s.
constexpr double usable_share = 0.65;

/// The first word of a file of sysfs; empty where it is not there.
std::string word_of(const fs::path& file) {
    std::ifstream in(file);
    std::string word;
    in >> word;
    return word;
}

fs::path node_of(const fs::path& device) {
    const auto number = [&](const char* name) { return std::atoi(word_of(device / name).c_str()); };
    return fmt::format("/dev/bus/usb/{:03}/{:03}", number("busnum"), number("devnum"));
}

LampBoardSeen board_at(const fs::path& device) {
    LampBoardSeen board{.node = node_of(device), .serial = word_of(device / "serial")};
    if (::access(board.node.c_str(), R_OK | W_OK) != 0)
        board.access = errno == EACCES || errno == EPERM ? Access::denied : Access::absent;
    return board;
}

/// The USB device above a camera's node; empty for a camera that is none.
fs::path usb_device_of(const fs::path& camera, const fs::path& sys) {
    std::error_code error;
    const fs::path node = fs::canonical(camera, error);
    if (error) return {};
    fs::path device = fs::canonical(sys / "class/video4linux" / node.filename() / "device", error);
    for (; !error && device.has_relative_path(); device = device.parent_path())
        if (fs::exists(device / "idVendor", error)) return device;
    return {};
}

/// "auto" lets the kernel put it to sleep when nobody uses it; a delay below 0 forbids it all the same.
void look_at_power(const std::string& what, const fs::path& device, MachineSeen& machine) {
    const std::string delay = word_of(device / "power/autosuspend_delay_ms");
    const bool may_sleep = word_of(device / "power/control") == "auto" && !delay.starts_with('-');
    machine.usb_power.push_back({what, device, may_sleep});
}

}  // namespace

void look_at_usb(const RigDescription& rig, MachineSeen& machine, const fs::path& sys) {
    const std::string vendor = fmt::format("{:04x}", lamp_protocol::vendor_id);
    const std::string product = fmt::format("{:04x}", lamp_protocol::product_id);
    std::error_code none;
    for (const auto& entry : fs::directory_iterator(sys / "bus/usb/devices", none)) {
        if (word_of(entry.path() / "idVendor") != vendor || word_of(entry.path() / "idProduct") != product ||
            word_of(entry.path() / "product") != "darkbox")
            continue;
        machine.boards.push_back(board_at(entry.path()));
        if (rig.lamps_driver == "usb") look_at_power("lamp controller", entry.path(), machine);
    }
    for (const char* folder : {"/lib/udev/rules.d", "/etc/udev/rules.d"})
        machine.lamp_rules = machine.lamp_rules || fs::exists(fs::path(folder) / "70-darkbox-lamps.rules");
    const fs::path given = rig.camera.device;
    if (rig.camera.driver != "v4l2") return;
    const fs::path camera = usb_device_of(given.is_absolute() ? given : fs::path("/dev/v4l/by-id") / given, sys);
    if (camera.empty()) return;
    if (const std::string speed = word_of(camera / "speed"); !speed.empty())
        machine.camera_bus_mbit = std::atof(speed.c_str());
    look_at_power("camera", camera, machine);
}

Diagnoses diagnose_usb_power(const MachineSeen& machine) {
    Diagnoses all;
    for (const UsbPowerSeen& seen : machine.usb_power) {
        const std::string subject = seen.what + "'s power";
        if (!seen.may_sleep) {
            all.push_back({subject, Verdict::good, "it is kept awake"});
            continue;
        }
        const std::string now = fmt::format("echo on | sudo tee {}/power/control", seen.device.string());
        all.push_back({subject, Verdict::warning,
                       "the kernel may put it to sleep between captures (autosuspend), and it wakes up cold",
                       machine.udev_rules
                           ? now + "; for good: sudo udevadm trigger --action=add, which applies darkbox' udev rules"
                           : now + "; for good: install darkbox-daemon, whose udev rules do so when it is plugged in"});
    }
    return all;
}

Diagnoses diagnose_usb_lamps(const RigDescription& rig, const MachineSeen& machine) {
    const std::string& serial = rig.usb.serial;
    const std::string subject = serial.empty() ? "lamp controller" : "lamp controller " + serial;
    std::vector<LampBoardSeen> boards = machine.boards;
    // Only whoever may open a board is told its serial by some systems: one without is not ruled out.
    std::erase_if(boards,
                  [&](const LampBoardSeen& b) { return !serial.empty() && !b.serial.empty() && b.serial != serial; });
    if (boards.empty())
        return {{subject, Verdict::bad,
                 machine.boards.empty() ? "none is plugged in"
                                        : fmt::format("another is plugged in: {}", machine.boards[0].serial),
                 machine.boards.empty() ? "plug it in, and check its supply; lsusb must show 1209:0001"
                                        : "correct serial under [lamps.usb], or plug the right one in"}};
    if (boards.size() > 1)
        return {{subject, Verdict::bad, fmt::format("{} are plugged in", boards.size()),
                 "name one by serial under [lamps.usb]; darkbox lamps list --boards lists them"}};
    const LampBoardSeen& board = boards.front();
    if (board.access == Access::open)
        return {{subject, Verdict::good, fmt::format("there, and open to {}", machine.user)}};
    return {{subject, Verdict::bad, fmt::format("{} may not open {}", machine.user, board.node.string()),
             machine.lamp_rules
                 ? join_group(machine, "darkbox")
                 : "sudo cp rig/system/70-darkbox-lamps.rules /etc/udev/rules.d/, or install darkbox-daemon; "
                   "then plug the controller in again"}};
}

double camera_megabytes_per_second(const RigDescription& rig) {
    const double pixels = static_cast<double>(rig.camera.width) * rig.camera.height;
    return pixels * 2 * rig.camera.frame_rate.value_or(0) / 1e6;
}

Diagnoses diagnose_camera_bus(const RigDescription& rig, const MachineSeen& machine) {
    const double wanted = camera_megabytes_per_second(rig);
    if (!machine.camera_bus_mbit || wanted == 0) return {};
    const double carried = usable_share * *machine.camera_bus_mbit / 8;
    const std::string found = fmt::format("{:.0f} MB/s at {:.0f} Mbit/s, which carry about {:.0f}", wanted,
                                          *machine.camera_bus_mbit, carried);
    if (wanted <= carried) return {{"camera's USB", Verdict::good, found}};
    return {{"camera's USB", Verdict::warning, found,
             *machine.camera_bus_mbit < 5000 ? "plug it into a USB 3 port (blue, or SS) by a USB 3 cable; else lower "
                                               "frame_rate or choose an 8-bit format"
                                             : "lower frame_rate, width or height of [camera]"}};
}

}  // namespace darkbox
