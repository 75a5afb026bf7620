#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "tests/support/child_process.h"

namespace darkbox::test {

/// The lamp controller's image that is flashed, emulated, as a USB device of the machine's kernel; what its shift
/// registers light is seen from outside. Plugged in by the constructor, unplugged by the destructor.
class UsbBoard {
public:
    static constexpr const char* serial = "LC-HIL";

    /// `folder` is for its files; `strobe`: the file that is the camera's strobe line, if it hears one.
    explicit UsbBoard(const std::filesystem::path& folder, const std::filesystem::path& strobe = {});

    void pull_cable();
    void plug_cable();
    /// Its main loop stands still, and its watchdog is what is left.
    void hang();
    /// Its device in usbfs, "/dev/bus/usb/003/002"; empty while the kernel sees none.
    std::string node() const;

    /// Bit n is lamp n.
    std::uint64_t lit() const;
    bool is_dark() const { return lit() == 0; }
    /// What burned, in order; darkness in between is left out.
    std::vector<std::uint64_t> history() const;
    const std::filesystem::path& record() const { return record_; }

    /// Ends it: how long it ran, in its own time and in the machine's.
    std::string unplug();

private:
    std::filesystem::path record_;
    ChildProcess process_;
};

}  // namespace darkbox::test
