#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "rig/description/rig_description.h"

namespace darkbox {

enum class Verdict { good, warning, bad };

/// What `darkbox doctor` has to say about one thing.
struct Diagnosis {
    std::string subject;
    Verdict verdict = Verdict::good;
    std::string found;
    std::string remedy = {};  ///< exactly what to do; empty when there is nothing to do
};
using Diagnoses = std::vector<Diagnosis>;

/// A file that may or may not be there and open to us.
enum class Access { open, absent, denied };

struct GpioLineSeen {
    std::string name;
    std::string holder = {};  ///< empty: free
};
struct GpioChipSeen {
    std::filesystem::path device;
    Access access = Access::open;
    std::string label = {};
    std::vector<GpioLineSeen> lines = {};
};

/// A lamp controller that is plugged in.
struct LampBoardSeen {
    std::filesystem::path node;  ///< below /dev/bus/usb
    Access access = Access::open;
    std::string serial = {};
};

/// A USB device of the rig that the kernel may or may not put to sleep.
struct UsbPowerSeen {
    std::string what;              ///< "camera", "lamp controller"
    std::filesystem::path device;  ///< below /sys
    bool may_sleep = false;
};

/// What the machine shows, gathered apart from what is made of it.
struct MachineSeen {
    std::string user;
    std::vector<std::string> groups;
    std::vector<GpioChipSeen> chips;
    Access camera = Access::absent;
    std::vector<std::filesystem::path> cameras;  ///< by their stable names
    std::string camera_group = "video";
    bool udev_rules = false;
    std::vector<LampBoardSeen> boards = {};
    bool lamp_rules = false;                     ///< udev's, for lamp controllers
    std::optional<double> camera_bus_mbit = {};  ///< a second; none: not known, or no USB camera
    std::vector<UsbPowerSeen> usb_power = {};
};
MachineSeen look_at_machine(const RigDescription& rig);

Diagnoses diagnose_camera(const RigDescription& rig, const MachineSeen& machine);
Diagnoses diagnose_lamps(const RigDescription& rig, const MachineSeen& machine);

Diagnoses diagnose_usb_lamps(const RigDescription& rig, const MachineSeen& machine);
/// Whether the camera's USB carries what its mode sends; nothing where either is not known.
Diagnoses diagnose_camera_bus(const RigDescription& rig, const MachineSeen& machine);

/// Whether the kernel leaves the rig's USB devices awake; nothing where there are none.
Diagnoses diagnose_usb_power(const MachineSeen& machine);

/// The remedy for a device that its group may use and this user may not.
std::string join_group(const MachineSeen& machine, const std::string& group);

/// The lamp controllers, the camera's bus and what may sleep, as sysfs shows them.
void look_at_usb(const RigDescription& rig, MachineSeen& machine, const std::filesystem::path& sys = "/sys");

/// What the camera sends at its rate, in megabytes a second; 0 where the description leaves it open.
double camera_megabytes_per_second(const RigDescription& rig);

/// Writes and flushes a file there, and removes it: whether that works, and how fast.
Diagnoses diagnose_disk(const RigDescription& rig, const std::filesystem::path& sessions);

}  // namespace darkbox
